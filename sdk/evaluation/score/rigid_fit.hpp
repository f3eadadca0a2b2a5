// Rigid motions, and the one that takes points nearest to others.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace defrec::cli {

// x_world = rotation * x_camera + position, mm.
struct Pose {
    cv::Matx33d rotation = cv::Matx33d::eye();
    cv::Vec3d position{0, 0, 0};
};
Pose inverse(const Pose& pose);
// a after b.
Pose operator*(const Pose& a, const Pose& b);

// The rotation and translation that take `from` nearest to `to`, by weighted least squares, in
// closed form: B. K. P. Horn, Closed-form solution of absolute orientation, J. Opt. Soc. Am. A 4,
// 1987. As many points and weights; at least one.
Pose rigid_fit(const std::vector<cv::Vec3d>& from, const std::vector<cv::Vec3d>& to,
               const std::vector<double>& weights);

}  // namespace defrec::cli
