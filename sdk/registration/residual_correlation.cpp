// See residual_correlation.hpp. The sum of the autocorrelation over a point's neighbours, out to
// where it has faded (Kish, Survey Sampling, 1965; the covariogram as in Cressie, Statistics for
// Spatial Data, 1993).
#include "sdk/registration/residual_correlation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "sdk/base/util/median.hpp"
#include "sdk/registration/decisions.hpp"

namespace defrec {
namespace {

using decisions::ResidualCorrelation;

}  // namespace

double design_effect(std::span<const Eigen::Vector3d> places, std::span<const double> values) {
    const size_t count = places.size();
    if (count < 2) return 1;
    const size_t step = count / ResidualCorrelation::kSamples + 1;
    std::vector<double> spacings;
    double variance = 0;
    for (size_t i = 0; i < count; ++i) variance += values[i] * values[i];
    variance /= static_cast<double>(count);
    for (size_t i = 0; i < count; i += step) {
        double least = std::numeric_limits<double>::infinity();
        for (size_t k = 0; k < count; ++k)
            if (k != i) least = std::min(least, (places[k] - places[i]).squaredNorm());
        spacings.push_back(std::sqrt(least));
    }
    const double bin = median(std::move(spacings)) * ResidualCorrelation::kBin;
    if (bin == 0 || variance == 0) return 1;
    std::vector<double> products(ResidualCorrelation::kBins), pairs(products.size());
    double samples = 0;
    for (size_t i = 0; i < count; i += step, ++samples)
        for (size_t k = 0; k < count; ++k) {
            const double distance = (places[k] - places[i]).norm();
            if (k == i || distance >= bin * static_cast<double>(products.size())) continue;
            const auto at = static_cast<size_t>(distance / bin);
            products[at] += values[i] * values[k];
            pairs[at] += 1;
        }
    double effect = 1;
    for (size_t at = 0; at < products.size(); ++at) {
        if (pairs[at] == 0) continue;
        const double correlation = products[at] / (pairs[at] * variance);
        if (correlation < ResidualCorrelation::kFaded) break;
        effect += products[at] / (samples * variance);
    }
    return effect;
}

}  // namespace defrec
