// Numbers of the definition of stage rectify (docs/stages/rectify.md), for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/glsl.h"
#ifdef __cplusplus
namespace defrec {
#endif

constexpr int kMapOne = 128;  // a map's unit: 1 px
// Weights of a colour's parts in its gray value, 1/256 (ITU-R BT.601).
constexpr int kRedWeight = 77, kGreenWeight = 150, kBlueWeight = 29;

#ifdef __cplusplus
}  // namespace defrec
#endif
