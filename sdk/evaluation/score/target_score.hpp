// How far targets beneath the surface are from the truth, by their depth.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "sdk/evaluation/score/coverage.hpp"
#include "sdk/evaluation/score/error_summary.hpp"
#include "sdk/evaluation/score/score_limits.hpp"
#include "sdk/evaluation/score/scored_targets.hpp"

namespace defrec::cli {

// Statistics of targets with a position.
struct TargetErrors {
    std::string status;  // as targets.csv names it, or "all"
    ErrorSummary errors;
    double mean_expected_mm = 0;  // NaN where none is stated
    Coverage coverage;
};

struct DepthScore {
    double min_depth = 0, max_depth = 0;  // mm; of one depth the same
    std::size_t rows = 0;                 // of the truth
    std::size_t lost = 0;                 // of them
    TargetErrors all;
    std::vector<TargetErrors> statuses;  // the more certain first
    ErrorSummary rigid;  // of targets that move with the best rigid fit of the true surface

    double lost_share() const;  // 0..1
    std::string name() const;   // "20 mm", "10 to 20 mm"
};

struct TargetScore {
    DepthScore all;
    // Ascending: one for each depth of the truth, or ranges of equal width where there are more
    // than 12; a range does not hold its max_depth.
    std::vector<DepthScore> depths;
    std::size_t not_followed = 0;    // targets of the truth
    std::vector<std::string> notes;  // what speaks against the truth being of these targets
    TruthDoubt doubt = {};
};

TargetScore target_score_of(const ScoredTargets& targets);

// Each status at each depth, named by both.
std::vector<StatusConfidence> confidences_of(const TargetScore& score);

// The score in a sentence.
std::string target_verdict(const TargetScore& score);
std::string target_table(const TargetScore& score);
nlohmann::ordered_json target_json(const TargetScore& score);

// What exceeds the limits at any depth, one message each.
std::vector<std::string> exceeded(const TargetScore& score, const ScoreLimits& limits);

}  // namespace defrec::cli
