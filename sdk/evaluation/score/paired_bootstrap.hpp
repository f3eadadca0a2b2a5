// How sure the difference of two methods is, by the clips that both did.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace defrec::cli {

struct PairedChange {
    std::size_t clips = 0;  // with both numbers
    // Mean over these clips of the second's number less the first's, and between what it lies in
    // 95 of 100 draws of as many clips, each drawn from all of them (percentile bootstrap, Efron
    // 1979). NaN without a clip; low and high also of a single one.
    double mean = std::numeric_limits<double>::quiet_NaN();
    double low = mean, high = mean;
};
// A number for each clip, in the same order; NaN: there is none. The same numbers give the same
// result.
PairedChange paired_change(const std::vector<double>& first, const std::vector<double>& second);

}  // namespace defrec::cli
