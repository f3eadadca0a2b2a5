// Arithmetic that the kernels of stage stereo share.
#pragma once
#include "backends/cuda/device/device_code.hpp"
#include "backends/stages/stereo.hpp"

namespace defrec::cuda {
namespace {

// Sums over windows of 2 kRadius + 1 along a line, at kRun places that are kStep (1 or 2) apart.
template <int kRadius, int kRun, int kStep>
__device__ __forceinline__ void sum_along(const int (&line)[kStep * (kRun - 1) + 1 + 2 * kRadius],
                                          int (&sums)[kRun]) {
    int sum = 0;
#pragma unroll
    for (int i = 0; i <= 2 * kRadius; ++i) sum += line[i];
    sums[0] = sum;
#pragma unroll
    for (int i = 1; i < kRun; ++i) {
#pragma unroll
        for (int k = 1; k <= kStep; ++k)
            sum += line[kStep * (i - 1) + 2 * kRadius + k] - line[kStep * i - k];
        sums[i] = sum;
    }
}

// Without the case of 0, where the number is some finite one. docs/stages/stereo.md, section 3.
__device__ __forceinline__ float inverse_root_of_positive(int value) {
    const float x = static_cast<float>(value), half = 0.5f * x;
    float y = __int_as_float(0x5f375a86 - (__float_as_int(x) >> 1));
    y = y * (1.5f - (half * y) * y);
    return y * (1.5f - (half * y) * y);
}
__device__ __forceinline__ float inverse_root(int value) {
    return value == 0 ? 0.0f : inverse_root_of_positive(value);
}

__device__ __forceinline__ int clamped(int value, int minimum, int maximum) {
    return max(minimum, min(value, maximum));
}

}  // namespace
}  // namespace defrec::cuda
