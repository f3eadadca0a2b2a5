// Expected errors beside measured ones.
#pragma once

#include <cstddef>
#include <vector>

#include "sdk/evaluation/score/coverage.hpp"

namespace defrec::cli {

// Samples with similar expected errors; both values are root mean squares, mm, and equal where
// expected errors hold.
struct ReliabilityBin {
    std::size_t count = 0;
    double expected_mm = 0, measured_mm = 0;
};

// The samples with an expected error, in ascending order of it, in bins of equal count: at most
// `max_bins`, and so few that each has `min_count` samples, but one where there are any.
std::vector<ReliabilityBin> reliability_of(std::vector<ErrorSample> samples, std::size_t max_bins,
                                           std::size_t min_count);

}  // namespace defrec::cli
