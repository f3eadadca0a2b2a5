// Where searches for a pose begin.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sdk/registration/pose.hpp"

namespace defrec {

// The start itself, and others that are spread evenly over turns of at most `turn` rad about the
// centre, and shifts of at most `shift_mm`, both after it.
std::vector<Pose> spread_starts(const Pose& start, const Eigen::Vector3d& centre, double turn,
                                double shift_mm, uint32_t count);

}  // namespace defrec
