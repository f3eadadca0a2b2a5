// FAST's score (docs/stages/orb.md, section 3) for the kernels of the stage orb.
#pragma once
#include <type_traits>
#include <utility>

#include "backends/cuda/device/device_code.hpp"
#include "backends/definition/orb_definition.hpp"

namespace defrec::cuda {
namespace {

// Two numbers of 16 bits in a word, each for itself: pixels, scores, keys.
__device__ inline uint32_t pair_of(uint32_t low, uint32_t high) { return low | high << 16; }
constexpr uint32_t kPairOfOnes = 0x00010001;

// The circle's pixels round `centre`, in order.
template <int kStride, class T, size_t... kPlaces>
__device__ void load_circle(const T* centre, uint32_t (&circle)[16],
                            std::index_sequence<kPlaces...>) {
    ((circle[kPlaces] = centre[std::integral_constant<int, orb::kCircle[kPlaces].y * kStride +
                                                               orb::kCircle[kPlaces].x>::value]),
     ...);
}

// Without threshold, of two pixels and their circles. The runs of 9 that start at 2k and at 2k + 1
// share 8.
__device__ inline uint32_t corner_scores(uint32_t centre, const uint32_t (&circle)[16]) {
    uint32_t least2[8], most2[8];
#pragma unroll
    for (int k = 0; k < 8; ++k) {
        least2[k] = __vminu2(circle[2 * k + 1], circle[(2 * k + 2) % 16]);
        most2[k] = __vmaxu2(circle[2 * k + 1], circle[(2 * k + 2) % 16]);
    }
    uint32_t least4[8], most4[8];
#pragma unroll
    for (int k = 0; k < 8; ++k) {
        least4[k] = __vminu2(least2[k], least2[(k + 1) % 8]);
        most4[k] = __vmaxu2(most2[k], most2[(k + 1) % 8]);
    }
    uint32_t brightest = 0, darkest = 255 * kPairOfOnes;  // of all runs
#pragma unroll
    for (int k = 0; k < 8; ++k) {
        const uint32_t one = circle[2 * k], other = circle[(2 * k + 9) % 16];
        const uint32_t least8 = __vminu2(least4[k], least4[(k + 2) % 8]),
                       most8 = __vmaxu2(most4[k], most4[(k + 2) % 8]);
        brightest = __vmaxu2(brightest, __vminu2(least8, __vmaxu2(one, other)));
        darkest = __vminu2(darkest, __vmaxu2(most8, __vminu2(one, other)));
    }
    constexpr uint32_t kZero = 256 * kPairOfOnes;  // differences are negative too
    return __vmaxu2(__vmaxu2(brightest + kZero - centre, centre + kZero - darkest), kZero) - kZero;
}

}  // namespace
}  // namespace defrec::cuda
