// A rig in OpenCV's terms: its calibration file, and the rectification that follows from it.
#pragma once

#include <Eigen/Core>
#include <string>

#include "sdk/scenes/rig.hpp"

namespace defrec::cli {

/// R1, P1 and P2 of cv::stereoRectify: rows correspond, and no pixel of the images is empty (alpha
/// 0). x_rectified = rotation * x_left; left and right project it, px and mm.
struct RectifiedViews {
    Eigen::Matrix3d rotation;
    Eigen::Matrix<double, 3, 4> left, right;
};
RectifiedViews rectified_views(const StereoRig& rig);

/// Its rotation.
Eigen::Matrix3d rectification(const StereoRig& rig);

/// Writes OpenCV's stereo YAML: image_width image_height M1 D1 M2 D2 R T. Throws FileError.
void write_calibration(const StereoRig& rig, const std::string& path);
/// The same without the size.
void write_stereo_calibration(const StereoRig& rig, const std::string& path);

}  // namespace defrec::cli
