// A stereo rig as ROS describes it: a sensor_msgs/CameraInfo for each camera, from a YAML file or
// from a message.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sdk/io/calibration.hpp"

namespace defrec::cli {

struct RosCamera {
    int width = 0, height = 0;                                          // px; 0: it does not say
    CameraCalibration camera;                                           // K and D
    std::array<double, 9> rectification = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // R, row-major
    std::array<double, 12> projection{};                                // P, row-major
    // "file:line: key" of each, for messages; empty where it is not given.
    std::string size_origin, rectification_origin, projection_origin;
};

// K, row-major, as the camera's matrix. Throws CliError(kCalibration) for one with skew.
void set_camera_matrix(const std::vector<double>& k, const std::string& origin,
                       CameraCalibration& camera);

// Throws CliError(kCalibration) unless the distortion has OpenCV's coefficients.
void check_distortion_model(const std::string& name, const std::string& origin);

// The rig, T in the unit of P, without the checks: it may be impossible. Throws
// CliError(kCalibration) where the cameras are exchanged, or are none.
StereoCalibration rig_of(const RosCamera& left, const RosCamera& right);

}  // namespace defrec::cli
