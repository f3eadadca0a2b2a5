// Checks of what a template gives to prepare, so that run can trust it: indices in range, numbers
// finite.
#pragma once
#include <cmath>
#include <string>

#include "backends/shared/live_depth.hpp"
#include "backends/shared/motion.hpp"
#include "backends/shared/stage.hpp"

namespace defrec {

constexpr bool all_finite(const float* values, size_t count) {
    for (size_t i = 0; i < count; ++i)
        if (!std::isfinite(values[i])) return false;
    return true;
}

// Throws unless position, control points and weights of a point or patch can be used.
template <class Point>
void check_skinned(const char* what, const Point* points, size_t count, size_t nodes) {
    for (size_t i = 0; i < count; ++i) {
        const Point& p = points[i];
        bool good = all_finite(p.position, 3) && all_finite(p.weight, DEFREC_SKIN_NODES);
        for (int k = 0; k < DEFREC_SKIN_NODES; ++k)
            good = good && p.node[k] >= 0 && size_t(p.node[k]) < nodes;
        if (!good)
            throw StageError(
                DEFREC_ERROR_ARGUMENT,
                std::string(what) + " " + std::to_string(i) +
                    " has a position or weight that is not finite, or a control point outside 0.." +
                    std::to_string(nodes) + " (exclusive)");
    }
}

// A motion of unit length; the identity where the given one has no finite value or no rotation.
template <class T>
constexpr DualQuaternion<T> usable_motion(const defrec_motion& motion) {
    if (!all_finite(motion.real, 4) || !all_finite(motion.dual, 4))
        return DualQuaternion<T>::identity();
    return normalise(DualQuaternion<T>::load(motion));
}

// The optional disparity image among a stage's inputs; its last row may end with its last pixel.
template <class Params>
DisparityImage take_disparity(const char* what, const Params& params, std::span<const InBuffer> in,
                              size_t index) {
    const size_t pixels =
        params.height == 0 ? 0 : size_t(params.height - 1) * params.stride + params.width;
    return {take_optional<int16_t>(what, in, index, pixels), params.width, params.height,
            params.stride};
}

}  // namespace defrec
