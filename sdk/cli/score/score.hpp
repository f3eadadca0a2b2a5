// How far tracked points are from the truth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sdk/cli/io/frame_source.hpp"

namespace defrec::cli {

// Of distances in mm; NaN where count is 0. Percentiles interpolate linearly between the two
// nearest ranks.
struct ErrorSummary {
    std::size_t count = 0;
    double median = 0, mean = 0, rmse = 0, p95 = 0, max = 0;
};
ErrorSummary summarise(std::vector<double> errors);

// One group of truth rows. A point counts as lost when it has no row, no position or status lost.
struct ScoreGroup {
    std::string name;  // a state of frames.csv
    std::size_t frames = 0;
    ErrorSummary visible, hidden;    // over points with a position
    std::size_t visible_points = 0;  // rows of the truth
    std::size_t lost_visible = 0;    // of them
    double lost_share() const;       // 0..1; 0 without visible points
};

struct Score {
    ScoreGroup all;
    std::vector<ScoreGroup> states;  // in order of first appearance; empty without frames.csv
    std::size_t frames_without_visible = 0;  // the share lost does not count these
};

// `folder` holds points.csv and, for the states, frames.csv. Truth: frame,id,x,y,z,visible. Throws
// CliError(kInput).
Score score_folder(const std::filesystem::path& folder, const std::filesystem::path& truth,
                   const FrameRange& range);

std::string score_table(const Score& score);
nlohmann::ordered_json score_json(const Score& score);

// What exceeds the limits, one error message; empty when nothing does. Nothing visible to measure
// exceeds every limit.
std::string exceeded(const Score& score, std::optional<double> max_median,
                     std::optional<double> max_p95);

}  // namespace defrec::cli
