// The stereo camera of a reference sequence.
#include "sdk/scenes/rig.hpp"

#include <Eigen/Geometry>

namespace defrec::cli {
namespace {

Eigen::Vector2d distorted(const Eigen::Vector2d& n, const std::array<double, 5>& k) {
    const double x = n.x(), y = n.y();
    const double r2 = x * x + y * y;
    const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    return {x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
            y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y};
}

StereoRig microscope_at(int width, int height, const Working& at) {
    StereoRig rig;
    rig.width = width;
    rig.height = height;
    rig.rectified = false;
    rig.depth = at.distance;
    const double focal = width * at.distance / at.field;
    rig.left = {focal, focal, 0.5 * (width - 1), 0.5 * (height - 1), {}};
    rig.right = rig.left;
    return rig;
}

}  // namespace

Eigen::Vector2d Lens::project(const Eigen::Vector3d& point) const {
    const Eigen::Vector2d n = distorted({point.x() / point.z(), point.y() / point.z()}, distortion);
    return {fx * n.x() + cx, fy * n.y() + cy};
}

Eigen::Vector2d Lens::ray(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d target((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
    Eigen::Vector2d n = target;
    for (int i = 0; i < 100; ++i) {
        const Eigen::Vector2d error = target - distorted(n, distortion);
        n += error;
        if (error.cwiseAbs().maxCoeff() < 1e-13) {
            break;
        }
    }
    return n;
}

StereoRig make_microscope(int width, int height, const Working& at, double baseline) {
    StereoRig rig = microscope_at(width, height, at);
    const double half_disparity = 0.5 * width * baseline / at.field;
    rig.left.cx -= half_disparity;
    rig.right.cx += half_disparity;
    rig.translation = {-baseline, 0, 0};
    return rig;
}

StereoRig make_toe_in(int width, int height, const Working& at, double angle) {
    StereoRig rig = microscope_at(width, height, at);
    rig.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
    const Eigen::Vector3d meeting(0, 0, at.distance);
    rig.translation = meeting - rig.rotation * meeting;
    return rig;
}

StereoRig make_rig(int width, int height, bool rectified) {
    const bool narrow = 4 * width <= 5 * height;
    const double focal = narrow ? 391.0 * width / 360.0 : 1000.0 * width / 960.0;
    const double baseline = narrow ? 5.5 : 4.6;
    StereoRig rig;
    rig.width = width;
    rig.height = height;
    rig.rectified = rectified;
    rig.depth = narrow ? 90.0 : 80.0;
    rig.left = {focal, focal, 0.5 * (width - 1), 0.5 * (height - 1), {}};
    rig.right = rig.left;
    rig.translation = {-baseline, 0.0, 0.0};
    if (!rectified) {
        const double px = focal / 1000.0;
        rig.left.fy *= 1.0012;
        rig.left.cx += 6.3 * px;
        rig.left.cy -= 4.1 * px;
        rig.left.distortion = {-0.281, 0.124, 0.00083, -0.00061, -0.021};
        rig.right.fx *= 1.0041;
        rig.right.fy *= 1.0050;
        rig.right.cx += 9.2 * px;
        rig.right.cy += 1.7 * px;
        rig.right.distortion = {-0.274, 0.117, -0.00047, 0.00072, -0.018};
        const Eigen::Vector3d axis_angle(0.0062, -0.0113, 0.0047);
        rig.rotation =
            Eigen::AngleAxisd(axis_angle.norm(), axis_angle.normalized()).toRotationMatrix();
        rig.translation = {-baseline, 0.09, -0.06};
    }
    return rig;
}

}  // namespace defrec::cli
