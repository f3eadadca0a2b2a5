// See target_mark.hpp.
#include "sdk/report/target_mark.hpp"

#include <cmath>

namespace defrec::cli {

TargetMark target_mark(const PointEstimate& target, const Projector& projector) {
    const auto& [x, y, z] = target.xyz;
    const float at[6] = {x, y, z, x + expected_error(target), y, z};
    float place[4];
    projector(at, 2, place);
    return {place[0], place[1], std::hypot(place[2] - place[0], place[3] - place[1])};
}

float expected_error(const PointEstimate& point) {
    const auto& covariance = point.covariance;
    return std::sqrt(covariance[0] + covariance[3] + covariance[5]);
}

}  // namespace defrec::cli
