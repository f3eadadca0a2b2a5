// See local_fit.hpp.
#include "sdk/tracking/map/local_fit.hpp"

#include <cmath>

#include "backends/shared/rigid_fit.hpp"
#include "sdk/tracking/decisions/states.hpp"

namespace defrec {
namespace {

using decisions::PieceSearch;

double squared(const Vec3<double>& v) { return dot(v, v); }

}  // namespace

RigidMap::RigidMap(const DualQuaternion<double>& motion) : shift_(translation(motion)) {
    const Vec3<double> x = rotate(motion, {1, 0, 0}), y = rotate(motion, {0, 1, 0}),
                       z = rotate(motion, {0, 0, 1});
    rows_[0] = {x.x, y.x, z.x};
    rows_[1] = {x.y, y.y, z.y};
    rows_[2] = {x.z, y.z, z.z};
}

DualQuaternion<double> fit_pairs(std::span<const PointPair> pairs) {
    RigidFit fit;
    for (const PointPair& pair : pairs) fit.add(1, pair.rest, pair.live);
    return normalise(fit.solve());
}

DualQuaternion<double> fit_near(std::span<const PointPair> pairs, const Vec3<double>& place) {
    constexpr double kReach = PieceSearch::kFitReach;
    RigidFit fit;
    for (const PointPair& pair : pairs)
        fit.add(PieceSearch::kFitElsewhere +
                    std::exp(-squared(pair.rest - place) / (2 * kReach * kReach)),
                pair.rest, pair.live);
    return normalise(fit.solve());
}

std::vector<PointPair> agreeing_pairs(std::span<const PointPair> pairs,
                                      const DualQuaternion<double>& motion) {
    const RigidMap map(motion);
    std::vector<PointPair> agree;
    agree.reserve(pairs.size());
    for (const PointPair& pair : pairs)
        if (squared(map(pair.rest) - pair.live) <=
            PieceSearch::kTolerance * PieceSearch::kTolerance)
            agree.push_back(pair);
    return agree;
}

}  // namespace defrec
