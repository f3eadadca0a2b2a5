// What the stages that move a surface have in common: the camera and the disparity image as shaders
// get them, and checks of a template's contents, so that a run can trust it. Shaders include this
// file as well, for the part outside __cplusplus.
#ifndef DEFREC_STAGES_SURFACE
#define DEFREC_STAGES_SURFACE
#include "backends/shared/live_depth_constants.h"
#include "backends/shared/motion_constants.h"
#ifdef __cplusplus
#include <cmath>
#include <string>

#include "backends/shared/live_depth.hpp"
#include "backends/stages/contract.hpp"

namespace defrec {
#endif

// A rectified camera in single precision.
struct FloatCamera {
    float fx, fy, cx, cy, baseline_mm;
    float disparity_offset;  // units of a disparity image
};

// The size of a disparity image, px; stride 0: there is none, and no depth anywhere.
struct DisparityGrid {
    int width, height, stride;
};

#ifdef __cplusplus
constexpr FloatCamera float_camera(const defrec_camera& camera) {
    return {float(camera.fx),          float(camera.fy),
            float(camera.cx),          float(camera.cy),
            float(camera.baseline_mm), float(kDisparityOne * camera.disparity_offset_px)};
}

// Params: of a stage that has the disparity image's size.
template <class Params>
constexpr DisparityGrid disparity_grid(const Params& params, bool given) {
    return {int32_t(params.width), int32_t(params.height), given ? int32_t(params.stride) : 0};
}
template <class Params>
constexpr DisparityImage disparity_image(const Params& params, const int16_t* data) {
    return {data, params.width, params.height, params.stride};
}
template <class Params>
constexpr uint64_t disparity_elements(const Params& params) {
    return image_elements(params.width, params.height, params.stride);
}

constexpr bool all_finite(const float* values, size_t count) {
    for (size_t i = 0; i < count; ++i)
        if (!std::isfinite(values[i])) return false;
    return true;
}

// Throws unless position, control points and weights of a point or patch can be used.
template <class Point>
void check_blended(const char* what, const Point* points, size_t count, size_t nodes) {
    for (size_t i = 0; i < count; ++i) {
        const Point& p = points[i];
        bool good = all_finite(p.position, 3) && all_finite(p.weight, DEFREC_BLEND_NODES);
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
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

}  // namespace defrec
#endif
#endif
