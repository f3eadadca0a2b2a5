// Numbers of the definition of stage align (docs/stages/align.md), for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/glsl.h"
#include "backends/shared/record_scales.h"
#ifdef __cplusplus
namespace defrec::align {
#endif

// Prediction.
constexpr Real kMinPatchDepthMm = 1.0;
// How far from 1 the squared length of a real part may be that needs no division by it: more than
// rounding to single precision leaves, and too little to see.
constexpr Real kUnitTolerance = 1e-6;
// Singular values of the map from the view to the live image, squared: within 0.4 and 2.5 px.
constexpr Real kMaxStretch2 = 6.25, kMinStretch2 = 0.16;
constexpr int kMaxMatrix = 4 * kPatchMatrixOne;  // largest entry of view_from_live that is followed

// Search.
constexpr int kUnscored = -0x7fffffff - 1;  // a displacement that cannot be scored
constexpr int kOneScore = 65536;            // ZNCC 1 in the search's scores
constexpr int kScoreShift = 4;              // from them to those of the records
constexpr int kMinUsableQuarters = 3;       // of a patch's pixels, for a score
constexpr uint kTooMuchTexture = 4096;      // 1/16 gray level; no patch deviates as much
// What a displacement of one px costs, 1/65536; grows with its square.
constexpr int kDistancePenalty = 32;
constexpr int kEvenSearch = 4;  // px; beyond, displacements with both coordinates odd are tried too

// Refinement.
constexpr int kShiftSteps = 4;        // Gauss-Newton steps, at most
constexpr int kShortStep = 4;         // 1/256 px; the last one
constexpr int kTooLongStep = 512;     // 1/256 px
constexpr int kTooHighScore = 65602;  // ZNCC 1.001: what is left to explain is mostly rounding
// Share of the trace of the normal equations that damps them.
constexpr float kShiftDamping = 1.0f / 1024.0f;
// A gradient of the light is believed where it leaves less than 1 / 1.5 of the squares.
constexpr float kMinSlopeGain = 1.5f;
constexpr float kFullPrecision = 0.1f;  // px; a patch located this well has information 1
constexpr float kMinNoise = 0.01f;      // 1 - ZNCC^2 in the information, at least

#ifdef __cplusplus
static_assert(kOneScore >> kScoreShift == kScoreOne);
}  // namespace defrec::align
#endif
