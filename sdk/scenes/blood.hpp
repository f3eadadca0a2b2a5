// A pool of blood on the tissue: where it lies and how thick it is.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "sdk/scenes/noise.hpp"

namespace defrec::cli {

/// Its border is a curve in material coordinates, so that it moves with the tissue; what lies
/// within it shows nothing of the tissue.
struct Blood {
    float s = 0, t = 0;  ///< where it wells up, material coordinates, mm
    float reach = 0;     ///< mm from there to the border, on average
    std::uint32_t seed = 0;
    double time = 0;  ///< frames; its surface ripples
};

/// The reach of the pool whose border passes through (s, t).
inline float blood_reach(const Blood& blood, float s, float t) {
    return std::hypot(s - blood.s, t - blood.t) +
           9.0f * gradient_noise(s / 19.0f, t / 19.0f, blood.seed) +
           2.6f * gradient_noise(s / 6.3f, t / 6.3f, blood.seed + 1);
}

/// mm from the border, positive inside.
inline float blood_inside(const Blood& blood, float s, float t) {
    return blood.reach - blood_reach(blood, s, t);
}

/// 0..1: the share of the tissue's own look that is gone. One half at 0.6 mm from the border.
inline float blood_cover(float inside) { return smooth_step(0.0f, 1.2f, inside); }

}  // namespace defrec::cli
