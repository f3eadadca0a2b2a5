// Errors of a camera's trajectory.
#pragma once

#include <vector>

#include "sdk/evaluation/score/rigid_fit.hpp"

namespace defrec::cli {

// Distances of the positions, mm, after the predicted trajectory has been taken nearest to the true
// one. As many of both.
std::vector<double> absolute_errors(const std::vector<Pose>& truth,
                                    const std::vector<Pose>& predicted);

// How far the predicted motion from a frame to the next is from the true one.
struct MotionError {
    double mm = 0, degrees = 0;
};
// One less than there are poses.
std::vector<MotionError> relative_errors(const std::vector<Pose>& truth,
                                         const std::vector<Pose>& predicted);

}  // namespace defrec::cli
