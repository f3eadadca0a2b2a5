// What the kernels of ransac share: the matched points of a block's threads, and sums over a block
// in an order that never changes.
#pragma once
#include "backends/cuda/ransac_rotation.cuh"

namespace defrec::cuda {
namespace {

constexpr uint32_t kHeld = 4;  // pairs that a thread holds in registers; those of longer lists are
                               // read again whenever they are needed
constexpr uint32_t kMinThreads = 64, kMaxThreads = 512;

struct Pair {
    Vec3<float> from{}, to{};  // template and live, mm
    bool taken = false;        // takes part; if not, both points are 0
};

// Points relative to an origin, which starts as 0. load(i) gives the Pair of match i.
template <class Load>
struct Pairs {
    Load load;
    uint32_t count;
    Vec3<float> from{}, to{};  // the origin
    Pair held[kHeld];

    __device__ Pairs(const Load& given, uint32_t matches) : load(given), count(matches) {
        for (uint32_t k = 0; k < kHeld; ++k) {
            const uint32_t i = k * blockDim.x + threadIdx.x;
            held[k] = i < count ? load(i) : Pair{};
        }
    }
    __device__ void turn_about(const Vec3<float>& origin_from, const Vec3<float>& origin_to) {
        from = origin_from;
        to = origin_to;
        for (Pair& pair : held) move(pair);
    }
    template <class Use>
    __device__ void each(Use&& use) const {
        for (const Pair& pair : held) use(pair);
        for (uint32_t i = kHeld * blockDim.x + threadIdx.x; i < count; i += blockDim.x) {
            Pair pair = load(i);
            move(pair);
            use(pair);
        }
    }

  private:
    __device__ void move(Pair& pair) const {
        if (!pair.taken) return;
        pair.from = pair.from - from;
        pair.to = pair.to - to;
    }
};

// Leaves in values[0] of each lane the sum over the warp of values[lane % kCount]: each step hands
// half of what is left to a partner.
template <int kHalf, int kCount>
__device__ void share_out(float (&values)[kCount]) {
    const bool upper = (threadIdx.x & kHalf) != 0;
    for (int i = 0; i < kHalf; ++i) {
        const float give = upper ? values[i] : values[i + kHalf],
                    keep = upper ? values[i + kHalf] : values[i];
        values[i] = keep + __shfl_xor_sync(kAllLanes, give, kHalf);
    }
    if constexpr (kHalf > 1) share_out<kHalf / 2>(values);
}

// Sums over the block. Two sets of partial sums, used in turn, so that one barrier a sum will do.
class BlockSums {
    static constexpr int kMax = 16;
    using Partial = float[kMax];  // of one warp
    using Partials = Partial[kMaxThreads / kWarp];

  public:
    static constexpr size_t kSharedBytes = 2 * sizeof(Partials);

    // Replaces each thread's values by their sums over the block. kCount: a power of two, at most
    // kMost.
    template <int kCount>
    __device__ void add_up(float (&values)[kCount]) {
        static_assert((kCount & (kCount - 1)) == 0 && kCount <= kMax);
        Partial* const partial = memory()[turn_];
        const uint32_t lane = threadIdx.x % kWarp, warps = blockDim.x / kWarp;
        if constexpr (kCount > 1) share_out<kCount / 2>(values);
        float sum = values[0];
        for (uint32_t other = kCount; other < kWarp; other *= 2)
            sum += __shfl_xor_sync(kAllLanes, sum, other);
        if (lane < kCount) partial[threadIdx.x / kWarp][lane] = sum;
        __syncthreads();
        sum = 0;
        for (uint32_t warp = lane / kCount; warp < warps; warp += kWarp / kCount)
            sum += partial[warp][lane % kCount];
        for (uint32_t other = kCount; other < kWarp; other *= 2)
            sum += __shfl_xor_sync(kAllLanes, sum, other);
        for (int i = 0; i < kCount; ++i) values[i] = __shfl_sync(kAllLanes, sum, i);
        turn_ ^= 1;
    }

  private:
    __device__ static Partials* memory() {
        __shared__ Partials partials[2];
        return partials;
    }
    uint32_t turn_ = 0;
};

}  // namespace
}  // namespace defrec::cuda
