// Percentiles of a sample.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace defrec::cli {

// Percentile of ascending values, share 0..1; interpolates linearly between the two nearest ranks.
// NaN for none.
inline double percentile(const std::vector<double>& ascending, double share) {
    if (ascending.empty()) return std::numeric_limits<double>::quiet_NaN();
    const double rank = share * static_cast<double>(ascending.size() - 1);
    const auto below = static_cast<std::size_t>(rank);
    const std::size_t above = std::min(below + 1, ascending.size() - 1);
    const double weight = rank - static_cast<double>(below);
    // Not the difference of the two: it is NaN where both are infinite.
    return weight > 0 ? (1 - weight) * ascending[below] + weight * ascending[above]
                      : ascending[below];
}

}  // namespace defrec::cli
