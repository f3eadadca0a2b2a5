// A rig in OpenCV's terms: its calibration file, and the rectification that follows from it.
#pragma once

#include <Eigen/Core>
#include <string>

#include "sdk/cli/render/rig.hpp"

namespace defrec::cli {

/// R1 of cv::stereoRectify: from the left camera into the left rectified camera.
Eigen::Matrix3d rectification(const StereoRig& rig);

/// Writes OpenCV's stereo YAML: image_width image_height M1 D1 M2 D2 R T. Throws RenderOutputError.
void write_calibration(const StereoRig& rig, const std::string& path);
/// The same without the size.
void write_stereo_calibration(const StereoRig& rig, const std::string& path);

}  // namespace defrec::cli
