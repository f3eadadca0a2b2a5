// See point_runs.hpp.
#include "sdk/predictor/point_runs.hpp"

#include <algorithm>

#include "include/defrec_c.h"
#include "sdk/predictor/decisions.hpp"

namespace defrec {

void PointRuns::end_all() { std::fill(is_known_.begin(), is_known_.end(), uint8_t{0}); }

void PointRuns::add(const FollowedPoints& frame, double max_motion_mm, MotionHistory& history) {
    const uint64_t number = history.newest();
    Eigen::Matrix3Xd& now = history.newest_frame().xyz;
    const Eigen::Matrix3Xd* before =
        history.oldest() == number ? nullptr : &history.at(number - 1).xyz;
    const Eigen::Map<const Eigen::Matrix3Xd> given(frame.xyz, 3, now.cols());
    for (std::size_t point = 0; point < size(); ++point) {
        const auto column = static_cast<Eigen::Index>(point);
        const bool known = frame.status[point] != DEFREC_POINT_UNKNOWN;
        if (!known) {
            is_known_[point] = 0;
            now.col(column).setZero();
            continue;
        }
        now.col(column) = given.col(column);
        const bool goes_on = before != nullptr && is_known_[point] != 0 &&
                             (now.col(column) - before->col(column)).norm() <= max_motion_mm;
        if (!goes_on) first_[point] = number;
        is_known_[point] = 1;
    }
}

Reach PointRuns::reach(std::size_t point, const MotionFrame& newest) const {
    if (!is_known(point)) return Reach::kUnknown;
    const std::vector<Taps>& lags = newest.lags;
    if (lags.size() <= 1 || !covers(point, lags[1].first)) return Reach::kPosition;
    const bool is_whole = lags.size() > decisions::PredictionGrid::kLags;
    return is_whole && covers(point, newest.lags_from) ? Reach::kLearned : Reach::kVelocity;
}

}  // namespace defrec
