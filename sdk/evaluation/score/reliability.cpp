// Expected errors beside measured ones.
#include "sdk/evaluation/score/reliability.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/base/util/array_part.hpp"

namespace defrec::cli {

std::vector<ReliabilityBin> reliability_of(std::vector<ErrorSample> samples, std::size_t max_bins,
                                           std::size_t min_count) {
    std::erase_if(samples,
                  [](const ErrorSample& sample) { return std::isnan(sample.expected_mm); });
    std::sort(samples.begin(), samples.end(), [](const ErrorSample& a, const ErrorSample& b) {
        return a.expected_mm < b.expected_mm;
    });
    if (samples.empty()) return {};
    const std::size_t count = std::clamp<std::size_t>(samples.size() / min_count, 1, max_bins);
    std::vector<ReliabilityBin> bins;
    for (std::size_t i = 0; i < count; ++i) {
        const ArrayPart bin{i, count};
        const std::size_t first = bin.begin(samples.size()), last = bin.end(samples.size());
        double expected = 0, measured = 0;
        for (std::size_t s = first; s < last; ++s) {
            expected += samples[s].expected_mm * samples[s].expected_mm;
            measured += samples[s].error_mm * samples[s].error_mm;
        }
        const auto size = static_cast<double>(last - first);
        bins.push_back({last - first, std::sqrt(expected / size), std::sqrt(measured / size)});
    }
    return bins;
}

}  // namespace defrec::cli
