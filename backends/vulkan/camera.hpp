// The push constants that shaders/live_depth.glsl declares.
#pragma once
#include <cstdint>

#include "include/defrec_c.h"

namespace defrec::vulkan {

struct Camera {
    float fx, fy, cx, cy, baseline_mm;
    explicit Camera(const defrec_camera& camera)
        : fx(float(camera.fx)),
          fy(float(camera.fy)),
          cx(float(camera.cx)),
          cy(float(camera.cy)),
          baseline_mm(float(camera.baseline_mm)) {}
};

struct DisparityImage {
    int32_t width, height, stride, given;
    // Params: of a stage that has the disparity image's size.
    template <class Params>
    DisparityImage(const Params& params, bool is_given)
        : width(int32_t(params.width)),
          height(int32_t(params.height)),
          stride(int32_t(params.stride)),
          given(is_given) {}
};

}  // namespace defrec::vulkan
