// Rows of the truth beside what was tracked for them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sdk/evaluation/score/tracked_positions.hpp"
#include "sdk/evaluation/score/truth_check.hpp"
#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

struct ScoredRow : ScoredPosition {
    std::string state;  // of the frame, by frames.csv; empty where it does not say
    bool truly_visible = false;
    // Distance of the projections into the rectified left camera; infinite where either position is
    // not in front of it. Nothing for lost points and without a camera.
    std::optional<double> error_px;
};

struct ScoredRows {
    std::vector<ScoredRow> rows;      // in the order of the truth; not empty
    std::vector<std::string> states;  // in order of first appearance; empty without frames.csv
    bool has_pixels = false;          // there is a camera
    std::size_t not_followed = 0;     // points of the truth
    std::vector<std::string> notes;   // what speaks against the truth being of these points
    TruthDoubt doubt = {};
};

// `folder` holds points.csv and, for the states, frames.csv; for the camera, summary.json. Truth:
// frame,id,x,y,z,visible. Throws CliError(kInput).
ScoredRows read_scored_rows(const std::filesystem::path& folder, const std::filesystem::path& truth,
                            const FrameRange& range, Unfollowed unfollowed = Unfollowed::kLeftOut);

}  // namespace defrec::cli
