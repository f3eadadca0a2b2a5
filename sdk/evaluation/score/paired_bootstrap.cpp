// How sure the difference of two methods is.
#include "sdk/evaluation/score/paired_bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "sdk/evaluation/score/percentile.hpp"

namespace defrec::cli {

PairedChange paired_change(const std::vector<double>& first, const std::vector<double>& second) {
    constexpr std::size_t kDraws = 2000;
    constexpr double kOutside = 0.025;  // on either side
    std::vector<double> changes;
    for (std::size_t i = 0; i < std::min(first.size(), second.size()); ++i)
        if (const double change = second[i] - first[i]; !std::isnan(change))
            changes.push_back(change);
    PairedChange result;
    result.clips = changes.size();
    if (changes.empty()) return result;
    const auto count = static_cast<double>(changes.size());
    result.mean = std::accumulate(changes.begin(), changes.end(), 0.0) / count;
    if (changes.size() == 1) return result;
    std::mt19937_64 random(1);  // its numbers are the same everywhere
    std::vector<double> means;
    for (std::size_t draw = 0; draw < kDraws; ++draw) {
        double sum = 0;
        for (std::size_t i = 0; i < changes.size(); ++i) sum += changes[random() % changes.size()];
        means.push_back(sum / count);
    }
    std::sort(means.begin(), means.end());
    result.low = percentile(means, kOutside);
    result.high = percentile(means, 1 - kOutside);
    return result;
}

}  // namespace defrec::cli
