// The rigid motion near a place, of tissue that is rigid in small parts only.
#pragma once
#include <span>
#include <vector>

#include "backends/shared/motion.hpp"

namespace defrec {

struct PointPair {
    Vec3<double> rest, live;
};

// The motion of all pairs alike (Kabsch).
DualQuaternion<double> fit_pairs(std::span<const PointPair> pairs);
// The motion of the pairs round a place at rest, more than of the others.
DualQuaternion<double> fit_near(std::span<const PointPair> pairs, const Vec3<double>& place);
// Those that a motion explains within decisions::PieceSearch::kTolerance.
std::vector<PointPair> agreeing_pairs(std::span<const PointPair> pairs,
                                      const DualQuaternion<double>& motion);

}  // namespace defrec
