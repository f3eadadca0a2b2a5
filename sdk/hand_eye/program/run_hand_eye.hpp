// `defrec handeye`: where the camera is on its marker.
#pragma once

#include <optional>
#include <string>

#include "sdk/hand_eye/program/pose_file.hpp"

namespace defrec::cli {

struct HandEyeCommand {
    std::string camera_poses, tracker_poses, out;
    std::optional<PoseUnit> camera_unit, tracker_unit;
    bool is_camera_inverted = false;   // the camera's file has camera from world
    bool is_tracker_inverted = false;  // the tracker's file has marker from tracking system
    bool is_paired = false;            // line i of both files belong together
    std::optional<double> offset_s, max_offset_s;
    std::optional<double> camera_error_mm, camera_error_degrees, tracker_error_mm,
        tracker_error_degrees;  // all or none
    std::optional<double> max_residual_mm, max_residual_degrees, max_error_mm;
    bool json = false, quiet = false;
};

// Returns the exit code: 0 where it is solved, 9 where it is refused.
int run_hand_eye(const HandEyeCommand& command);

}  // namespace defrec::cli
