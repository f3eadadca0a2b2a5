// See pose_stream.hpp.
#include "sdk/hand_eye/pose_stream.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/base/util/error.hpp"
#include "sdk/hand_eye/decisions.hpp"

namespace defrec {

using decisions::HandEyePoses;

Eigen::Vector3d turn_of(const Eigen::Matrix3d& rotation) {
    const Eigen::AngleAxisd turn(rotation);
    return turn.angle() * turn.axis();
}

void check_poses(const std::vector<TimedPose>& poses, std::string_view name) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const Eigen::Matrix4d& matrix = poses[i].pose.matrix();
        if (!matrix.allFinite()) fail(DEFREC_ERROR_ARGUMENT, name, ": pose ", i, " is not finite");
        const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
        const double off =
            (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
        if (off > HandEyePoses::kRotation || rotation.determinant() < 0)
            fail(DEFREC_ERROR_ARGUMENT, name, ": pose ", i,
                 " is no rotation and translation: R R^T differs from 1 by ", off,
                 ", or mirrors; expected at most ", HandEyePoses::kRotation);
    }
}

PoseStream::PoseStream(std::vector<TimedPose> poses, std::string_view name)
    : poses_(std::move(poses)) {
    check_poses(poses_, name);
    if (poses_.empty()) fail(DEFREC_ERROR_ARGUMENT, name, ": there are no poses");
    std::vector<double> intervals;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
        if (!std::isfinite(poses_[i].time_s))
            fail(DEFREC_ERROR_ARGUMENT, name, ": the time of pose ", i, " is not finite");
        if (i == 0) continue;
        const double interval = poses_[i].time_s - poses_[i - 1].time_s;
        if (!(interval > 0))
            fail(DEFREC_ERROR_ARGUMENT, name, ": the time of pose ", i, ", ", poses_[i].time_s,
                 " s, is not after that of the one before, ", poses_[i - 1].time_s, " s");
        intervals.push_back(interval);
    }
    if (intervals.empty()) return;
    const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
    std::nth_element(intervals.begin(), middle, intervals.end());
    interval_ = *middle;
    max_gap_ = std::max(HandEyePoses::kMaxGap * interval_, HandEyePoses::kMinGap);
}

std::optional<BetweenPose> PoseStream::at(double time_s) const {
    if (!(time_s >= begin() && time_s <= end())) return {};
    const auto after =
        std::lower_bound(poses_.begin(), poses_.end(), time_s,
                         [](const TimedPose& pose, double time) { return pose.time_s < time; });
    if (after->time_s == time_s) return BetweenPose{after->pose, 0};
    const auto before = after - 1;
    const double interval = after->time_s - before->time_s;
    if (interval > max_gap_) return {};
    const double share = (time_s - before->time_s) / interval;
    const Eigen::Matrix3d from = before->pose.linear();
    BetweenPose between{Eigen::Isometry3d::Identity(), share};
    between.pose.linear() =
        from * rotation_of(share * turn_of(from.transpose() * after->pose.linear()));
    between.pose.translation() =
        (1 - share) * before->pose.translation() + share * after->pose.translation();
    return between;
}

}  // namespace defrec
