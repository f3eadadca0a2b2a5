// Poses with their times, and poses between them.
#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string_view>
#include <vector>

#include "sdk/registration/pose.hpp"

namespace defrec {

struct TimedPose {
    double time_s = 0;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  // mm
};

// The rotation vector of a rotation: axis times angle, rad; the inverse of rotation_of.
Eigen::Vector3d turn_of(const Eigen::Matrix3d& rotation);

// Throws Error where a pose is not finite or no rotation; name: whose poses, for the message.
void check_poses(const std::vector<TimedPose>& poses, std::string_view name);

// A pose between two of a stream.
struct BetweenPose {
    Eigen::Isometry3d pose;
    double share = 0;  // 0: at the earlier of both, 1: at the later one
};

// Poses in the order of their times.
class PoseStream {
  public:
    // Throws Error as check_poses, and where times are not finite or do not grow.
    PoseStream(std::vector<TimedPose> poses, std::string_view name);

    const std::vector<TimedPose>& poses() const { return poses_; }
    double begin() const { return poses_.front().time_s; }
    double end() const { return poses_.back().time_s; }
    double interval() const { return interval_; }  // median, s
    // The place moves along a line, the rotation about a fixed axis. Empty outside of the stream,
    // and in gaps.
    std::optional<BetweenPose> at(double time_s) const;

  private:
    std::vector<TimedPose> poses_;
    double interval_ = 0, max_gap_ = 0;
};

}  // namespace defrec
