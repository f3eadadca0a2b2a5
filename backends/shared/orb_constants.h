// Numbers of the definition of stage orb (docs/stages/orb.md), for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/glsl.h"
#ifdef __cplusplus
namespace defrec::orb {

struct Offset {
    int32_t x, y;
};
#else
#define Offset ivec2
#endif

constexpr int kPatchRadius = 15;  // px of the level: orientation and descriptor look no farther
constexpr int kSmoothRadius = 2;  // of the binomial window before the descriptor's comparisons
constexpr int kCircleRadius = 3;  // of FAST's circle
constexpr int kBorder = kPatchRadius + kSmoothRadius;  // px of each level without features
constexpr int kFarthest = 63;  // px; distances to a stronger corner are cut off here
constexpr int kBins = 32;      // of directions
constexpr int kTests = 256;    // of the descriptor, a bit each

// The 16 pixels at distance kCircleRadius round a corner, in order.
constexpr Offset kCircle[16] = {{0, -3}, {1, -3},  {2, -2},  {3, -1}, {3, 0},  {3, 1},
                                {2, 2},  {1, 3},   {0, 3},   {-1, 3}, {-2, 2}, {-3, 1},
                                {-3, 0}, {-3, -1}, {-2, -2}, {-1, -3}};
// Half the width of the disc x^2 + y^2 <= 15.5^2 in row +-y.
constexpr int kDiscHalfWidth[kPatchRadius + 1] = {15, 15, 15, 15, 14, 14, 14, 13,
                                                  13, 12, 11, 10, 9,  8,  6,  3};
// round(1024 * cos, sin) of the borders between the bins of the first quarter turn, 5.625 + k *
// 11.25 degrees. A macro, since CUDA's device code reads no array outside of its functions.
// clang-format off
#define DEFREC_ORB_BIN_BORDERS {{1019, 100}, {980, 297}, {903, 483}, {792, 650}, \
                                {650, 792}, {483, 903}, {297, 980}, {100, 1019}}
// clang-format on

#ifdef __cplusplus
}  // namespace defrec::orb
#endif
