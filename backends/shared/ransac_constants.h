// Numbers of the definition of stage ransac (docs/stages/ransac.md), for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/glsl.h"
#ifdef __cplusplus
namespace defrec::ransac {
#endif

constexpr float kMaxCoordinateMm = 1e6f;  // matches beyond take no part
constexpr float kKeptWeight = 0.8f;  // matches with a smaller merged weight are not preselected
constexpr int kRefinements = 4;      // of the best reference's motion over its inliers
// The threshold where none is given: a share of the spread of the matches.
constexpr Real kMinThreshold = 1.0;  // mm
constexpr Real kThresholdShare = 0.1;
// The support that a reference needs: a quarter of the best one's, and more than wrong matches
// reach by chance, min_support and a 32nd of all.
constexpr uint kBestDivisor = 4, kChanceDivisor = 32;

#ifdef __cplusplus
}  // namespace defrec::ransac
#endif
