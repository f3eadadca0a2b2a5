// Medians and percentiles of times, and how far to trust them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace defrec::cli {

// The value below or at which `share` (0..1) of the values lie, by nearest rank; 0 for none.
inline double nearest_rank(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    const auto rank =
        static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1)));
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank),
                     values.end());
    return values[rank];
}

// Standard error of the median of times in the order in which they were taken, from the medians of
// eight equal parts of the run: what other work on the machine changes from one second to the next
// is in it. 0 for fewer than 16 times.
inline double median_noise(const std::vector<double>& values) {
    constexpr std::size_t kParts = 8;
    if (values.size() < 2 * kParts) return 0;
    double sum = 0, squares = 0;
    for (std::size_t part = 0; part < kParts; ++part) {
        const auto at = [&](std::size_t i) {
            return values.begin() + static_cast<std::ptrdiff_t>(values.size() * i / kParts);
        };
        const double median = nearest_rank({at(part), at(part + 1)}, 0.5);
        sum += median;
        squares += median * median;
    }
    const double variance = std::max(0.0, squares / kParts - sum * sum / (kParts * kParts));
    return std::sqrt(variance / (kParts - 1));
}

}  // namespace defrec::cli
