// See tissue_colours.hpp.
#include "sdk/tracking/evidence/tissue_colours.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "sdk/base/util/median.hpp"
#include "sdk/tracking/decisions/unseen.hpp"

namespace defrec {
namespace {

using Decision = decisions::TissueColours;

}  // namespace

void TissueColours::forget() {
    own_.clear();
    is_learnt_ = false;
    frames_ = 0;
    shift_.setZero();
}

Chromaticity TissueColours::colour_at(const defrec_surface_sample& sample) const {
    if (sample.observation == DEFREC_OUTSIDE) return no_colour();
    const std::optional<Eigen::Vector2d> pixel = rig_->pixel_of(0, sample.position, false);
    return pixel ? cells_.at(pixel->x(), pixel->y()) : no_colour();
}

bool TissueColours::is_covered(size_t vertex, const defrec_surface_sample& sample) const {
    if (vertex >= own_.size()) return false;
    const Chromaticity now = colour_at(sample) - shift_, own = own_[vertex];
    // False where one is not known.
    const bool is_other =
        (now - own).matrix().norm() >
        std::max(Decision::kLeastChange, Decision::kChangeShare * own.matrix().norm());
    if (!is_other) return false;
    const Eigen::Vector2f off = now - mean_;
    return off.dot(inverse_ * off) > Decision::kFar * Decision::kFar;
}

void TissueColours::learn(std::span<const defrec_surface_sample> samples,
                          std::span<const uint8_t> shown) {
    if (!cells_.any()) return;
    own_.resize(samples.size(), no_colour());
    for (std::vector<float>& shifts : shifts_) shifts.clear();
    const size_t step = frames_ == 0 ? 1 : Decision::kLearnEvery;
    for (size_t i = frames_ % step; i < samples.size(); i += step) {
        if (shown[i] == 0) continue;
        const Chromaticity now = colour_at(samples[i]);
        if (now.isNaN().any()) continue;
        Chromaticity& own = own_[i];
        if (own.isNaN().any()) {
            own = now - shift_;
            continue;
        }
        const Chromaticity change = now - own;
        for (Eigen::Index k = 0; k < 2; ++k) shifts_[k].push_back(change[k]);
        own += Decision::kForget * (change - shift_);
    }
    ++frames_;
    for (Eigen::Index k = 0; k < 2; ++k)
        if (!shifts_[k].empty()) shift_[k] = median_in_place(shifts_[k]);
    learn_spread();
}

void TissueColours::learn_spread() {
    Eigen::Vector2f sum = Eigen::Vector2f::Zero();
    Eigen::Matrix2f products = Eigen::Matrix2f::Zero();
    float count = 0;
    for (size_t i = 0; i < own_.size(); i += Decision::kLearnEvery) {
        if (own_[i].isNaN().any()) continue;
        sum += own_[i].matrix();
        products += own_[i].matrix() * own_[i].matrix().transpose();
        ++count;
    }
    is_learnt_ = count >= Decision::kMinVertices;
    if (!is_learnt_) return;
    mean_ = sum / count;
    Eigen::Matrix2f covariance = products / count - mean_.matrix() * mean_.matrix().transpose();
    covariance.diagonal().array() += Decision::kLeastSpread * Decision::kLeastSpread;
    inverse_ = covariance.inverse();
}

}  // namespace defrec
