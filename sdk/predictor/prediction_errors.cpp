// See prediction_errors.hpp.
#include "sdk/predictor/prediction_errors.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/predictor/decisions.hpp"

namespace defrec {
namespace {

using decisions::PredictionMemory;

// An exponential mean.
void blend(double& mean, double value, double seconds, double memory_s) {
    const double age = std::min(seconds, PredictionMemory::kMaxAge);
    mean += (1 - std::exp(-age / memory_s)) * (value - mean);
}

}  // namespace

PredictionErrors::PredictionErrors(std::size_t points, double horizon_s) : own_(points) {
    const double unknown = PredictionMemory::kUnknownSpeed * horizon_s;
    mean_.fill(unknown * unknown);
}

void PredictionErrors::add_means(const ByBasis& all, const ByBasis& compared, double seconds) {
    if (is_empty_) {
        mean_ = all;
        compared_ = compared;
        is_empty_ = false;
    }
    for (std::size_t basis = 0; basis < kBases; ++basis) {
        blend(mean_[basis], all[basis], seconds, PredictionMemory::kAll);
        blend(compared_[basis], compared[basis], seconds, PredictionMemory::kChoice);
    }
}

void PredictionErrors::add_own(std::size_t point, double squared, double seconds) {
    double& own = own_[point];
    if (own == 0)
        own = squared;
    else
        blend(own, squared, seconds, PredictionMemory::kOwn);
}

Basis PredictionErrors::best(Basis last) const {
    if (is_empty_) return last;
    auto best = static_cast<std::size_t>(last);
    for (std::size_t basis = best; basis-- > 0;)
        if (compared_[basis] < compared_[best]) best = basis;
    return static_cast<Basis>(best);
}

}  // namespace defrec
