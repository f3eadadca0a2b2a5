// Numbers of rigid motions (docs/stages.md, docs/stages/lm.md), for C++ and GLSL.
#ifndef DEFREC_SHARED_MOTION_CONSTANTS
#define DEFREC_SHARED_MOTION_CONSTANTS
#include "backends/shared/glsl.h"
#ifdef __cplusplus
namespace defrec {
#endif

// Length of a blended real part below which the blend has vanished.
constexpr Real kMinBlendLength = 1e-6;
// Single precision holds in full what lies between; factors that bring numbers whose squares do not
// to where they do.
constexpr Real kLeastFloat = 1.1754943508222875e-38;   // 2^-126
constexpr Real kLargestFloat = 3.4028234663852886e38;  // 2^128 - 2^104
// A sum of squares as large keeps all that it is rounded from where smaller ones than kLeastFloat
// are taken for 0, as they may be by a GPU.
constexpr Real kLeastSquares = 7.888609052210118e-31;  // 2^-100
constexpr Real kEnlarge = 18446744073709551616.0;      // 2^64
constexpr Real kReduce = 1.3552527156068805e-20;       // 2^-66
// Second singular value of the moment of pairs of points below which they fix no rotation, mm^2.
constexpr Real kMinSpreadMm2 = 1e-2;

#ifdef __cplusplus
}  // namespace defrec
#endif
#endif
