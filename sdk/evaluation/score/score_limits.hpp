// What a score is asked to keep within.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sdk/evaluation/score/error_summary.hpp"

namespace defrec::cli {

struct ScoreLimits {
    std::optional<double> max_median_mm, max_p95_mm;
    bool calibrated = false;  // no status is below CoverageBands

    bool any() const { return max_median_mm || max_p95_mm || calibrated; }
};

// What exceeds the limits of the errors, one message each; `over` says whose errors they are. No
// error to measure exceeds every limit.
std::vector<std::string> exceeded(const std::string& over, const ErrorSummary& errors,
                                  const ScoreLimits& limits);

// One error message of them all; empty for none.
std::string joined(const std::vector<std::string>& messages);

}  // namespace defrec::cli
