// Numbers of the definition of stage warp (docs/stages/warp.md), for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/glsl.h"
#ifdef __cplusplus
#include "include/defrec_c.h"
namespace defrec {
#endif

// What a sample's observation says.
constexpr uint kObserved = 0, kNoDepth = 1, kOccluded = 2, kOutside = 3, kInconsistent = 4;

#ifdef __cplusplus
static_assert(kObserved == DEFREC_OBSERVED && kNoDepth == DEFREC_NO_DEPTH &&
              kOccluded == DEFREC_OCCLUDED && kOutside == DEFREC_OUTSIDE &&
              kInconsistent == DEFREC_INCONSISTENT);
}  // namespace defrec
#endif
