// Sums over a block in fixed trees, and what stage lm sums over the whole surface.
#pragma once
#include "backends/cuda/lm_view.hpp"

namespace defrec::cuda {
namespace {

// values[i]: a lane's part of sum i. Each exchange halves what a lane is still concerned with: lane
// l ends with sum l * kCount / 32.
template <uint32_t kCount, uint32_t kApart = kWarp / 2>
__device__ __forceinline__ float warp_sums(float (&values)[kCount]) {
    const bool upper = (threadIdx.x & kApart) != 0;
    if constexpr (kCount == 1) {
        values[0] += __shfl_xor_sync(kAllLanes, values[0], kApart);
        if constexpr (kApart > 1) return warp_sums<1, kApart / 2>(values);
        return values[0];
    } else {
        constexpr uint32_t kHalf = kCount / 2;
        float kept[kHalf];
        for (uint32_t i = 0; i < kHalf; ++i) {
            const float passed =
                __shfl_xor_sync(kAllLanes, upper ? values[i] : values[kHalf + i], kApart);
            kept[i] = (upper ? values[kHalf + i] : values[i]) + passed;
        }
        return warp_sums<kHalf, kApart / 2>(kept);
    }
}

// The sums over the block, to all threads. A barrier must lie between two calls with the same
// memory.
template <uint32_t kCount, uint32_t kWarps>
__device__ __forceinline__ void block_sums(float (&values)[kCount],
                                           float (&warps)[kWarps][kCount]) {
    constexpr uint32_t kLanes = kWarp / kCount;  // that end with the same sum
    const uint32_t lane = threadIdx.x % kWarp;
    const float sum = warp_sums(values);
    if (lane % kLanes == 0) warps[threadIdx.x / kWarp][lane / kLanes] = sum;
    __syncthreads();
    if constexpr (kCount <= 4) {
        for (uint32_t i = 0; i < kCount; ++i) {
            float total = warps[0][i];
            for (uint32_t w = 1; w < kWarps; ++w) total += warps[w][i];
            values[i] = total;
        }
    } else {  // too many for each thread to add them up by itself
        if (threadIdx.x < kCount)
            for (uint32_t w = 1; w < kWarps; ++w) warps[0][threadIdx.x] += warps[w][threadIdx.x];
        __syncthreads();
        for (uint32_t i = 0; i < kCount; ++i) values[i] = warps[0][i];
    }
}

// Over all residuals. Counts stay below 2^24 in a block, and are exact.
enum LmSumOf : uint32_t {
    kIcp,
    kMatch,
    kPatch,
    kTerms,  // costs of the terms with residuals
    kArap = kTerms,
    kWeights,  // of each term, then likewise
    kResidualSquares = kWeights + kTerms,
    kCounts = kResidualSquares + kTerms,
    kWithoutSurface = kCounts + kTerms,  // points without live surface
    kFarthest  // not a sum: the longest squared step, mm^2; infinite where one is not finite
};
static_assert(kFarthest < kSums);

// Leaves the block's part where the others find it.
__device__ __forceinline__ void publish_sums(float (&values)[kSums], float farthest, float* sums) {
    __shared__ float warps[kLmWarps][kSums];
    constexpr uint32_t kLanes = kWarp / kSums;
    const uint32_t lane = threadIdx.x % kWarp;
    float sum = warp_sums(values);
    for (uint32_t apart = kWarp / 2; apart > 0; apart /= 2)
        farthest = fmaxf(farthest, __shfl_xor_sync(kAllLanes, farthest, apart));
    if (lane / kLanes == kFarthest) sum = farthest;
    if (lane % kLanes == 0) warps[threadIdx.x / kWarp][lane / kLanes] = sum;
    __syncthreads();
    if (threadIdx.x >= kSums) return;
    sum = warps[0][threadIdx.x];
    for (uint32_t w = 1; w < kLmWarps; ++w)
        sum = threadIdx.x == kFarthest ? fmaxf(sum, warps[w][threadIdx.x])
                                       : sum + warps[w][threadIdx.x];
    sums[blockIdx.x * kSums + threadIdx.x] = sum;
}

// The sums of those blocks' parts, for the block's first thread, by kLmThreads threads of it: all
// blocks that ask add them up in the same order.
__device__ __forceinline__ void collect_sums(const float* sums, uint32_t blocks,
                                             double (&total)[kSums]) {
    constexpr uint32_t kGroups = kLmThreads / kSums;
    static_assert(2 * kSums == kWarp);
    __shared__ double parts[kLmWarps][kSums];
    const uint32_t which = threadIdx.x % kSums, group = threadIdx.x / kSums;
    const auto add = [which](double a, double b) {
        return which == kFarthest ? (a < b ? b : a) : a + b;
    };
    if (threadIdx.x < kLmThreads) {
        constexpr uint32_t kAhead = 8;  // loaded before the first is added
        double part = 0;
        for (uint32_t first = group; first < blocks; first += kAhead * kGroups) {
            float ahead[kAhead];
            for (uint32_t k = 0; k < kAhead; ++k) {
                const uint32_t block = first + k * kGroups;
                ahead[k] = block < blocks ? sums[block * kSums + which] : 0.0f;
            }
            for (const float value : ahead) part = add(part, double(value));
        }
        part = add(part, __shfl_down_sync(kAllLanes, part, kSums));
        if (threadIdx.x % kWarp < kSums) parts[threadIdx.x / kWarp][which] = part;
    }
    __syncthreads();
    if (threadIdx.x >= kWarp) return;
    double part = parts[0][which];
    for (uint32_t w = 1; w < kLmWarps; ++w) part = add(part, parts[w][which]);
    if (threadIdx.x < kSums) total[which] = part;
    __syncwarp();
}

}  // namespace
}  // namespace defrec::cuda
