// Numbers of the definition of stage lm (docs/stages/lm.md), for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/glsl.h"
#ifdef __cplusplus
namespace defrec {
#endif

// Damping, and when to stop.
constexpr Real kMinLambda = 1e-7, kMaxLambda = 1e7;
constexpr Real kLambdaDown = 1.0 / 7.5, kLambdaUp = 10.0;
constexpr Real kMinDiagonal = 1e-6;         // of a block's trace, added to its diagonal
constexpr Real kConjugateTolerance = 1e-3;  // of the preconditioned residual's norm
// No control point moves farther, itself or by rotation at one spacing: converged.
constexpr Real kMinStepMm = 0.01;
constexpr Real kMinDecrease = 1e-4;  // of the cost that is left: converged
// Share of a diagonal element that its pivot is raised to where single precision loses it.
constexpr float kMinPivot = 1e-6f;

// Data terms.
// Cosine between a surface and the direction to the camera below which ICP ignores it.
constexpr Real kMinFacing = 0.25;
constexpr Real kMatchDepthWeight = 0.25;  // stereo depth is less certain than direction

// ARAP term.
constexpr Real kArapShare = 0.02;    // of the data's weight, at arap_weight 1
constexpr Real kMinLengthMm = 1e-3;  // edges that have shrunk below count as this long

// Before iterating: rounds, and preselected matches that are needed.
constexpr int kPresolveRounds = 5, kPresolveMinMatches = 20;
constexpr float kPresolveMinChange = 1e-3f;  // of the squared distances, for another round
// Tukey's constant is at least 3 times the root of the mean squared distance.
constexpr Real kPresolveMinWidth2 = 9.0;

#ifdef __cplusplus
}  // namespace defrec
#endif
