// Numbers of the definition of stage stereo (docs/stages/stereo.md), for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/glsl.h"
#include "backends/shared/record_scales.h"
#ifdef __cplusplus
namespace defrec {
#endif

constexpr int kNoDisparity = -32768;
constexpr int kMaxDisparity = 32000;  // 1/16 px, refined
constexpr int kTextureOne = 16;       // gray level of the parameter texture
constexpr int kTextureOne2 = kTextureOne * kTextureOne;
constexpr int kInpaintRadius = 8;
constexpr int kGroup = 4;  // disparities of the search that share one entry of the uniqueness test
constexpr uint kMaxIndex = 255;    // of a disparity in a key: no two indices differ by more
constexpr int kSupportRange = 32;  // 1/16 px of half resolution
// In samples, from here on.
constexpr int kSupportRadius = 2, kEdgeRadius = 2, kHalfSmoothRadius = 1, kSpeckleRadius = 2;
constexpr int kSearchSmoothRange = 24, kHalfSmoothRange = 16;
constexpr int kUpsampleRange = 48;  // 1/16 px of half resolution
// 1/4096: the smallest refined ZNCC where the search has settled the disparity.
constexpr int kTrustedScore = 512;
constexpr int kFilledConfidence = 8;
// What is known of a pixel's hypothesis before it is refined.
constexpr int kDoubtful = 0, kOpen = 1, kSettled = 2;
// round(32768 / n): 1/n in 15 bits, for means over up to 5 neighbours.
constexpr int kReciprocal[6] = {0, 32767, 16384, 10923, 8192, 6554};
// Eighths that the sample of half resolution before pixel x has in it, by x % 4.
constexpr int kSampleWeight[4] = {7, 7, 5, 3};

#ifdef __cplusplus
static_assert(kNoDisparity == DEFREC_DISPARITY_NONE);
}  // namespace defrec
#endif
