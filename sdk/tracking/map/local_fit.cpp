// See local_fit.hpp.
#include "sdk/tracking/map/local_fit.hpp"

#include <cmath>

#include "backends/shared/rigid_fit.hpp"
#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {
namespace {

using decisions::PieceSearch;

double squared(const Vec3<double>& v) { return dot(v, v); }

}  // namespace

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
    std::vector<PointPair> agree;
    for (const PointPair& pair : pairs)
        if (squared(apply(motion, pair.rest) - pair.live) <=
            PieceSearch::kTolerance * PieceSearch::kTolerance)
            agree.push_back(pair);
    return agree;
}

}  // namespace defrec
