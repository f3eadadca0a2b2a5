// The stereo camera of a reference sequence: lenses with OpenCV's distortion model and the pose
// between the views.
#pragma once

#include <Eigen/Core>
#include <array>

namespace defrec::cli {

/// A pinhole with radial and tangential distortion, as OpenCV's calib3d documentation defines it.
struct Lens {
    double fx = 0, fy = 0, cx = 0, cy = 0;  ///< px
    std::array<double, 5> distortion{};     ///< k1 k2 p1 p2 k3

    /// Pixel of a point in this camera's frame, z > 0.
    Eigen::Vector2d project(const Eigen::Vector3d& point) const;
    /// (x/z, y/z) of the ray through a pixel, to 1e-12.
    Eigen::Vector2d ray(const Eigen::Vector2d& pixel) const;
};

/// x_right = rotation * x_left + translation, mm.
struct StereoRig {
    int width = 0, height = 0;  ///< px
    Lens left, right;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    bool rectified = true;
    double depth = 0;  ///< mm, at which the scene is set up
};

/// Focal length about 1,000 px at width 960, baseline 4.6 mm, depth 80 mm; images of 5:4 and
/// narrower have 391 px at width 360, 5.5 mm, 90 mm. A raw rig has distortion, a
/// small rotation and vertical offsets.
StereoRig make_rig(int width, int height, bool rectified);

/// The place where the views of a stereo microscope meet.
struct Working {
    double distance, field;  ///< mm; field: that the width shows there
};

/// A stereo microscope whose views have the same place in the middle. Parallel axes, principal
/// points apart: both views share one objective.
StereoRig make_microscope(int width, int height, const Working& at, double baseline);
/// Two cameras that are turned towards each other, at the same distance.
StereoRig make_toe_in(int width, int height, const Working& at, double angle);

}  // namespace defrec::cli
