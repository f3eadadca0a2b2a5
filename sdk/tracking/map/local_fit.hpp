// The rigid motion near a place, of tissue that is rigid in small parts only.
#pragma once
#include <span>
#include <vector>

#include "backends/shared/motion.hpp"

namespace defrec {

struct PointPair {
    Vec3<double> rest, live;
};

// A rigid motion of many points.
class RigidMap {
  public:
    explicit RigidMap(const DualQuaternion<double>& motion);
    Vec3<double> turned(const Vec3<double>& v) const {
        return {dot(rows_[0], v), dot(rows_[1], v), dot(rows_[2], v)};
    }
    Vec3<double> operator()(const Vec3<double>& place) const { return turned(place) + shift_; }

  private:
    Vec3<double> rows_[3], shift_;
};

// The motion of all pairs alike (Kabsch).
DualQuaternion<double> fit_pairs(std::span<const PointPair> pairs);
// The motion of the pairs round a place at rest, more than of the others.
DualQuaternion<double> fit_near(std::span<const PointPair> pairs, const Vec3<double>& place);
// Those that a motion explains within decisions::PieceSearch::kTolerance.
std::vector<PointPair> agreeing_pairs(std::span<const PointPair> pairs,
                                      const DualQuaternion<double>& motion);

}  // namespace defrec
