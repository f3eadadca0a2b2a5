// Numbers of the definition of stage match (docs/stages/match.md), for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/glsl.h"
#ifdef __cplusplus
namespace defrec::match {
#endif

constexpr int kMaxDistance = 256;  // bits of a descriptor
constexpr int kNoDistance = kMaxDistance + 1;
constexpr int kRatioOne = 256;  // of the parameter ratio
// The same corner is often found on two levels: features this near each other, 1/16 px in x and y,
// are one place.
constexpr uint kSamePlace = 64;

#ifdef __cplusplus
}  // namespace defrec::match
#endif
