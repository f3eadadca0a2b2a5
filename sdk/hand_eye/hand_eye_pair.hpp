// A pose of the camera and one of its marker at one time, and how well a transform fits both.
#pragma once
#include <Eigen/Geometry>
#include <vector>

namespace defrec {

struct HandEyePair {
    Eigen::Isometry3d camera;   // world from camera
    Eigen::Isometry3d tracker;  // tracking system from marker
    // The marker's speeds, for a change of the offset between the clocks: rad / s in its own frame,
    // mm / s in the tracking system's.
    Eigen::Vector3d turn_rate = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
};

using HandEyePairs = std::vector<HandEyePair>;

// Standard deviations along and about each axis.
struct HandEyeNoise {
    double camera_mm, camera_rad;    // of the camera's poses, in the camera
    double tracker_mm, tracker_rad;  // of the tracker's, at the marker
};

// tracker * marker_from_camera = tracker_from_world * camera, AX = ZB.
struct HandEyeTransforms {
    Eigen::Isometry3d marker_from_camera = Eigen::Isometry3d::Identity();
    Eigen::Isometry3d tracker_from_world = Eigen::Isometry3d::Identity();
};

using HandEyeResidual = Eigen::Matrix<double, 6, 1>;  // rad, then mm, in the camera
using HandEyeMatrix = Eigen::Matrix<double, 6, 6>;

// The camera by the tracking system, as the camera's own pose has it.
HandEyeResidual hand_eye_residual(const HandEyePair& pair, const HandEyeTransforms& transforms);

// The matrix by which residuals become independent of each other, with variance 1. An error of the
// marker's rotation moves the camera by the distance between both.
HandEyeMatrix hand_eye_whitening(const HandEyeNoise& noise, const HandEyeTransforms& transforms);

}  // namespace defrec
