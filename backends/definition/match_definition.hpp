// What every backend of the stage match shares (docs/stages/match.md): the tests of a match, and
// lifting to 3D.
#pragma once
#include <algorithm>

#include "backends/stages/match.hpp"

namespace defrec::match {

// The three nearest live features of a landmark, -1 where there are fewer; of equally near ones
// those of lower index.
struct Nearest {
    int32_t feature[3] = {-1, -1, -1};
    int32_t distance[3] = {kNoDistance, kNoDistance, kNoDistance};
};

// The nearest live feature, and how far the nearest one at another place is.
struct TwoBest {
    int32_t feature = -1;
    int32_t distance = kNoDistance, second = kNoDistance;
};

struct Inputs {
    uint32_t count;  // of live features
    const defrec_feature* features;
    const int16_t* disparity;
};

constexpr TwoBest choose(const Inputs& inputs, const Nearest& nearest) {
    TwoBest best{nearest.feature[0], nearest.distance[0], nearest.distance[1]};
    if (nearest.feature[1] < 0) return best;
    const defrec_feature &a = inputs.features[nearest.feature[0]],
                         &b = inputs.features[nearest.feature[1]];
    const auto near = [](int32_t p, int32_t q) {  // places are whatever the caller gave
        return (p > q ? uint32_t(p) - uint32_t(q) : uint32_t(q) - uint32_t(p)) <= kSamePlace;
    };
    if (near(a.x, b.x) && near(a.y, b.y)) best.second = nearest.distance[2];
    return best;
}

// Near enough, and clearly nearer than any other feature.
constexpr bool accepts(const defrec_match_params& p, const TwoBest& best) {
    return best.feature >= 0 && best.distance <= int32_t(p.max_distance) &&
           best.distance * kRatioOne <= int32_t(p.ratio) * best.second;
}

// The record of one landmark. T: the precision of the lifting.
template <class T>
constexpr defrec_match lift(const defrec_match_params& p, const Inputs& inputs, const TwoBest& best,
                            bool accepted) {
    defrec_match match{};
    match.feature = accepted ? best.feature : -1;
    match.distance = std::min(best.distance, int32_t{kMaxDistance});
    match.second = std::min(best.second, int32_t{kMaxDistance});
    if (!accepted) return match;
    const defrec_feature& feature = inputs.features[best.feature];
    const Pixel<T> pixel{std::clamp(T(feature.x) / T(kFeatureOne), T(0), T(p.width - 1)),
                         std::clamp(T(feature.y) / T(kFeatureOne), T(0), T(p.height - 1))};
    match.u = float(pixel.u);
    match.v = float(pixel.v);
    const T z =
        live_depth(p.camera, DisparityImage{inputs.disparity, p.width, p.height, p.stride}, pixel);
    if (!(z > T(0))) return match;
    match.position[0] = float((pixel.u - T(p.camera.cx)) * z / T(p.camera.fx));
    match.position[1] = float((pixel.v - T(p.camera.cy)) * z / T(p.camera.fy));
    match.position[2] = float(z);
    match.weight = 1;
    return match;
}

}  // namespace defrec::match
