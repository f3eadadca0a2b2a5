// How far, and about which axes, a set of poses is turned: a transform follows from rotations about
// two axes at least.
#pragma once
#include <vector>

#include "sdk/hand_eye/hand_eye_pair.hpp"

namespace defrec {

struct RotationSpread {
    double turn = 0;   // rad, root mean square against the mean rotation
    double cross = 0;  // rad, that of the parts across the main axis
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // the main axis, in the marker's frame
};

// is_used: which poses of the marker count, empty: all.
RotationSpread rotation_spread(const HandEyePairs& pairs, const std::vector<std::uint8_t>& is_used);

}  // namespace defrec
