// What the shaders of stage orb are given beside the constants, and what they leave to each other,
// for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#include "backends/vulkan/shaders/shader_types.hpp"
namespace defrec::vulkan {
#endif

struct OrbGiven {
    int mask;      // 1: there is one
    int exported;  // a bit for each of the optional outputs 2, 3 and 4
};

// Blocks of 4 x 4 pixels of the finer level in a work group that makes two: as many as whole blocks
// of the coarser one come from.
const int kTwoColumns = 20, kTwoRows = 5;

const int kDistances = 64, kScores = 256;
struct OrbCounts {  // of corners
    uint of_distance[kDistances];
    uint of_score[kDistances][kScores];
};

struct OrbSelection {
    uint groups[3];  // of the description: one for each feature
    // Corners with at least this distance, or one less and at least this score, are kept.
    uint distance, score;
};

#ifdef __cplusplus
}  // namespace defrec::vulkan
#endif
