// What the files of the CPU's ransac share: the usable matches as structure of arrays, and one
// hypothesis's work on them.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec::cpu {

constexpr size_t kRansacPadding = 16;  // arrays are padded to a multiple of this, with used 0

struct RansacPairs {
    const float *from[3], *to[3], *used;  // template and live, mm; used: 1, or 0 in the padding
    size_t padded;
};

struct RansacHypothesis {
    uint32_t support;
    float rotation[9];  // row-major
};

// Follows the pair `reference` through `iterations` alternations of rotation and weights. squares:
// of each pair's distance, mm^2, `padded` long.
void ransac_follow(const RansacPairs& pairs, size_t reference, uint32_t iterations, float threshold,
                   RansacHypothesis& out, float* squares);

// The rotation R, row-major, that maximises the sum of R_ij m_ij; never a reflection. The identity
// for m = 0.
void nearest_rotation(const double m[9], float out[9]);

}  // namespace defrec::cpu
