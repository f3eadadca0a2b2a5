// See frame_interval.hpp.
#include "sdk/predictor/frame_interval.hpp"

#include <algorithm>
#include <cmath>

#include "include/defrec_c.h"
#include "sdk/base/util/median.hpp"
#include "sdk/predictor/decisions.hpp"

namespace defrec {

using decisions::PredictionGrid;

FrameInterval::FrameInterval() { intervals_.reserve(PredictionGrid::kIntervals); }

bool FrameInterval::add(double interval_s) {
    if (intervals_.size() < PredictionGrid::kIntervals) {
        intervals_.push_back(interval_s);
    } else {
        intervals_[next_] = interval_s;
        next_ = (next_ + 1) % intervals_.size();
    }
    median_ = median(intervals_);
    const double now = frames_per_step_ * median_;
    const bool is_like = is_known() && std::abs(now / step_s_ - 1) <= PredictionGrid::kRateChange;
    unlike_ = is_like ? 0 : unlike_ + 1;
    const bool is_settled = intervals_.size() == PredictionGrid::kIntervals;
    if (is_like || (is_settled && unlike_ < PredictionGrid::kIntervals)) return false;
    unlike_ = 0;
    frames_per_step_ = std::max(1.0, std::round(PredictionGrid::kStep / median_));
    step_s_ = frames_per_step_ * median_;
    return true;
}

bool FrameInterval::is_gap(double interval_s) const {
    return is_known() &&
           interval_s > std::max(PredictionGrid::kMaxGap * median_, PredictionGrid::kMinGap);
}

int FrameInterval::horizons() const {
    constexpr double kLatest = 1e-3 * int{DEFREC_MAX_PREDICTION_MS};
    const double steps = kLatest / step_s_;
    return std::max(1, static_cast<int>(std::ceil(steps - PredictionGrid::kShort)));
}

}  // namespace defrec
