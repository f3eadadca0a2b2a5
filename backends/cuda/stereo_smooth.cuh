// The smoothing of section 6 of docs/stages/stereo.md along a line, in exact floating-point
// arithmetic: numbers are integers below 2^24 or such integers over a power of two, and floats are
// what the multiprocessors add fastest.
#pragma once
#include "backends/cuda/device_code.hpp"
#include "backends/stages/stereo.hpp"

namespace defrec::cuda {
namespace {

// How a missing disparity takes part: further than any range from those there are, and seven of
// them sum to less than 2^18.
constexpr float kMissing = 36000.0f;
static_assert(7 * 36000 < (1 << 18));

__device__ __forceinline__ float to_smooth(int disparity) {
    return disparity == kNoDisparity ? kMissing : static_cast<float>(disparity);
}
__device__ __forceinline__ int from_smooth(float value) {
    return value == kMissing ? kNoDisparity : static_cast<int>(value);
}

// For n = 0 .. 7: n, and kReciprocal[n] / 2^15 (for n = 1 any will do: the sum of differences is
// 0).
constexpr int kMeans = 8;
constexpr int rounded_reciprocal(int n) { return n == 0 ? 0 : (32768 + n / 2) / n; }
static_assert(rounded_reciprocal(2) == kReciprocal[2] && rounded_reciprocal(3) == kReciprocal[3] &&
              rounded_reciprocal(4) == kReciprocal[4] && rounded_reciprocal(5) == kReciprocal[5] &&
              rounded_reciprocal(6) == kReciprocal[6] && rounded_reciprocal(7) == kReciprocal[7]);
__device__ __forceinline__ void make_means(float2* means) {
    const int n = static_cast<int>(threadIdx.x);
    if (n < kMeans)
        means[n] = make_float2(static_cast<float>(n),
                               static_cast<float>(rounded_reciprocal(n)) * 0x1p-15f);
}

// means: of make_means, in shared memory.
template <int kRadius, int kRun>
__device__ __forceinline__ void smooth_along(const float (&line)[kRun + 2 * kRadius], float range,
                                             const float2* means, float (&smoothed)[kRun]) {
    constexpr float kOne =
        0x1p18f;  // a total counts the near ones above the sum of their disparities
    float counted[kRun + 2 * kRadius], total[kRun];
#pragma unroll
    for (int i = 0; i < kRun + 2 * kRadius; ++i) counted[i] = line[i] + kOne;
#pragma unroll
    for (int i = 0; i < kRun; ++i) total[i] = counted[i + kRadius];
#pragma unroll
    for (int a = 0; a < kRun + kRadius; ++a) {
#pragma unroll
        for (int b = a + 1; b <= a + kRadius; ++b) {
            const bool a_inside = a >= kRadius, b_inside = b >= kRadius && b < kRun + kRadius;
            if (!a_inside && !b_inside) continue;
            const bool near = fabsf(line[b] - line[a]) <= range;
            if (a_inside && near) total[a_inside ? a - kRadius : 0] += counted[b];
            if (b_inside && near) total[b_inside ? b - kRadius : 0] += counted[a];
        }
    }
#pragma unroll
    for (int i = 0; i < kRun; ++i) {
        const int n = (__float_as_int(total[i] + 0x1p23f) >> 18) & 7;
        const float2 mean = means[n];
        const float sum = __fmaf_rn(-mean.x, counted[i + kRadius], total[i]);
        // floor(sum * reciprocal + 1/2): less the half and with half a unit more it has no ties
        // when it is rounded.
        const float shift = __fmaf_rn(sum, mean.y, 0x1p-16f);
        smoothed[i] = line[i + kRadius] + ((shift + 0x1.8p23f) - 0x1.8p23f);
    }
}

}  // namespace
}  // namespace defrec::cuda
