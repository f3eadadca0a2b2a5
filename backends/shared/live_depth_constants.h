// Numbers of the rule of live depth (docs/stages/warp.md), for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/glsl.h"
#include "backends/shared/record_scales.h"
#ifdef __cplusplus
namespace defrec {
#endif

constexpr Real kMinDepthMm = 1e-3;  // nearer points, and those behind the camera, fall nowhere
// 1/16 px; disparities farther apart are not interpolated between.
constexpr int kLargestDepthStep = 32;

#ifdef __cplusplus
}  // namespace defrec
#endif
