// Numbers of rigid motions (docs/stages.md, docs/stages/lm.md), for C++ and GLSL.
#ifndef DEFREC_SHARED_MOTION_CONSTANTS
#define DEFREC_SHARED_MOTION_CONSTANTS
#include "backends/shared/glsl.h"
#ifdef __cplusplus
namespace defrec {
#endif

// Length of a blended real part below which the blend has vanished.
constexpr Real kMinBlendLength = 1e-6;
// Second singular value of the moment of pairs of points below which they fix no rotation, mm^2.
constexpr Real kMinSpreadMm2 = 1e-2;

#ifdef __cplusplus
}  // namespace defrec
#endif
#endif
