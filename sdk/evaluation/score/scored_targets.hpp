// Targets beneath the surface: rows of their truth beside what was tracked for them.
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

struct ScoredTarget : ScoredPosition {
    double depth = 0;  // mm beneath the surface, by the truth
    // The error of a target that moves with the best rigid fit of the true visible surface, from
    // the first frame to this one; nothing where that is not known.
    std::optional<double> rigid_mm;
};

// The truth of targets, beside that of the surface.
inline constexpr char kDeepTruthFile[] = "truth_deep.csv";

struct ScoredTargets {
    std::vector<ScoredTarget> rows;  // in the order of the truth; not empty
    std::vector<std::string> notes;  // what speaks against the truth being of these targets
    TruthDoubt doubt = {};
    std::size_t not_followed = 0;  // targets of the truth
};

// tracked: targets.csv of `defrec track`. truth:
// frame,id,depth,x,y,z. surface_truth: frame,id,x,y,z,visible; empty: none. Throws
// CliError(kInput).
ScoredTargets read_scored_targets(const std::filesystem::path& tracked,
                                  const std::filesystem::path& truth,
                                  const std::filesystem::path& surface_truth,
                                  const FrameRange& range,
                                  Unfollowed unfollowed = Unfollowed::kLeftOut);

}  // namespace defrec::cli
