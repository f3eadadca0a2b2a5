// The smoothing of section 6 of docs/stages/stereo.md, in exact floating-point arithmetic: numbers
// are integers or integers over 2^16 of up to 24 bits, and floats are what the multiprocessors add
// fastest.
#pragma once
#include "backends/cuda/device/device_code.hpp"
#include "backends/stages/stereo.hpp"

namespace defrec::cuda {
namespace {

// How a missing disparity takes part: further than any range from those there are.
constexpr float kMissing = 36000.0f;

__device__ __forceinline__ float to_smooth(int disparity) {
    return disparity == kNoDisparity ? kMissing : static_cast<float>(disparity);
}
__device__ __forceinline__ int from_smooth(float value) {
    return value == kMissing ? kNoDisparity : static_cast<int>(value);
}

// 1 / n for a mean over n, as the definition has it.
template <int n>
constexpr float kPart = static_cast<float>(kReciprocal[n]) * 0x1p-15f;

// The middle of a line, smoothed along it.
template <int kRadius>
__device__ __forceinline__ float smooth_middle(const float (&line)[2 * kRadius + 1], float range) {
    static_assert(kRadius == 1 || kRadius == 2);
    const float here = line[kRadius];
    float sum = 0;
    int n = 1;
#pragma unroll
    for (int i = 0; i <= 2 * kRadius; ++i) {
        if (i == kRadius) continue;
        const float difference = line[i] - here;
        const bool near = fabsf(difference) <= range;
        sum += near ? difference : 0.0f;
        n += near;
    }
    // For n = 1 any will do: the sum is 0.
    float part = n < 3 ? kPart<2> : kPart<3>;
    if (kRadius == 2) part = n < 4 ? part : n == 4 ? kPart<4> : kPart<5>;
    // floor(sum * part + 1/2): less the half and with half a unit more it has no ties when it
    // is rounded.
    const float shift = __fmaf_rn(sum, part, 0x1p-16f);
    return here + ((shift + 0x1.8p23f) - 0x1.8p23f);
}

// The middle of 3 x 3, smoothed along rows and then along the column.
__device__ __forceinline__ float smooth_centre(const float (&cells)[3][3], float range) {
    float column[3];
#pragma unroll
    for (int v = 0; v < 3; ++v) column[v] = smooth_middle<1>(cells[v], range);
    return smooth_middle<1>(column, range);
}

}  // namespace
}  // namespace defrec::cuda
