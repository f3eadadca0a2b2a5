// Checks of what a template gives to prepare, so that run can trust it: indices in range, numbers finite.
#pragma once
#include <cmath>
#include <string>

#include "backends/shared/motion.hpp"
#include "backends/shared/stage.hpp"

namespace defrec {

inline bool all_finite(const float* values, size_t count) {
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
DualQuaternion<T> usable_motion(const defrec_motion& motion) {
    if (!all_finite(motion.real, 4) || !all_finite(motion.dual, 4)) return DualQuaternion<T>::identity();
    return normalise(DualQuaternion<T>::load(motion));
}

}  // namespace defrec
