// Stage orb, section 6 (docs/stages/orb.md): the choice of the corners that are kept.
#include "backends/cuda/orb_steps.hpp"

namespace defrec::cuda {
namespace {

constexpr uint32_t kThreads = 1024, kWarps = kThreads / kWarp;
constexpr uint32_t kScores = 256, kDistances = kOrbKeys / kScores;
static_assert(kWarps == kWarp && kDistances == 2 * kWarp);

// The lane's value and those of the lanes before it, or behind it.
__device__ uint32_t sum_up_to(uint32_t value, uint32_t lane) {
    for (uint32_t step = 1; step < kWarp; step *= 2) {
        const uint32_t before = __shfl_up_sync(kAllLanes, value, step);
        if (lane >= step) value += before;
    }
    return value;
}
__device__ uint32_t sum_from(uint32_t value, uint32_t lane) {
    for (uint32_t step = 1; step < kWarp; step *= 2) {
        const uint32_t behind = __shfl_down_sync(kAllLanes, value, step);
        if (lane + step < kWarp) value += behind;
    }
    return value;
}

// The least key, spacing * kScores or more, of which and above which there are no more corners than
// the capacity. By one warp. of_distance: numbers of corners; counts: of each key.
__device__ uint32_t find_min_key(uint32_t lane, uint32_t spacing, uint32_t capacity,
                                 const uint32_t* of_distance, const uint32_t* counts) {
    // How many are at least so far falls as the distance grows, so that the first distance that
    // fits is the least.
    const uint32_t far = sum_from(of_distance[kWarp + lane], lane);
    const uint32_t near = sum_from(of_distance[lane], lane) + __shfl_sync(kAllLanes, far, 0);
    const uint32_t near_fits = __ballot_sync(kAllLanes, lane >= spacing && near <= capacity);
    const uint32_t far_fits = __ballot_sync(kAllLanes, kWarp + lane >= spacing && far <= capacity);
    const auto first_of = [](uint32_t bits) {
        return static_cast<uint32_t>(__ffs(static_cast<int>(bits))) - 1;
    };
    const uint32_t distance = near_fits != 0  ? first_of(near_fits)
                              : far_fits != 0 ? kWarp + first_of(far_fits)
                                              : kDistances;
    if (distance == spacing) return distance * kScores;

    // Corners a pixel nearer fit too from some score on: each lane looks at some scores, the last
    // lane at the best.
    const uint32_t kept_near = __shfl_sync(kAllLanes, near, static_cast<int>(distance % kWarp));
    const uint32_t kept_far = __shfl_sync(kAllLanes, far, static_cast<int>(distance % kWarp));
    constexpr uint32_t kEach = kScores / kWarp;
    const uint32_t first_key = (distance - 1) * kScores + kEach * lane;
    uint32_t of_key[kEach], sum = 0;
    for (uint32_t i = 0; i < kEach; ++i) sum += of_key[i] = counts[first_key + i];
    uint32_t count = (distance < kWarp        ? kept_near
                      : distance < kDistances ? kept_far
                                              : 0) +
                     sum_from(sum, lane) - sum;
    uint32_t minimum = distance * kScores;
    for (uint32_t i = kEach; i-- > 0;) {
        count += of_key[i];
        if (count <= capacity) minimum = first_key + i;
    }
    for (int step = 16; step > 0; step /= 2)
        minimum = min(minimum, __shfl_xor_sync(kAllLanes, minimum, step));
    return minimum;
}

// A thread looks at so many cells beside each other at once.
constexpr uint32_t kCells = 32, kLoads = kCells * sizeof(uint16_t) / sizeof(uint4);

// A bit for each of the cells: whether its key is large enough.
__device__ uint32_t kept_of(const uint4* keys, uint32_t min_key) {
    uint32_t kept = 0;
#pragma unroll
    for (uint32_t i = 0; i < kLoads; ++i) {
        const uint4 eight = keys[i];
        const uint32_t pairs[4] = {eight.x, eight.y, eight.z, eight.w};
#pragma unroll
        for (uint32_t k = 0; k < 4; ++k) {
            const uint32_t low = (pairs[k] & 0xffff) >= min_key ? 1 : 0,
                           high = pairs[k] >> 16 >= min_key ? 2 : 0;
            kept |= (low | high) << (8 * i + 2 * k);
        }
    }
    return kept;
}

// One block, whose threads share out the cells in runs. runs: of kCells; keys behind the last cell
// are 0.
__global__ void __launch_bounds__(kThreads)
    choose(OrbConstants constants, uint32_t runs, const uint4* keys, const uint32_t* counts,
           uint32_t* kept, uint32_t* feature_count) {
    __shared__ uint32_t of_distance[kDistances];
    __shared__ uint32_t shared_min_key;
    __shared__ uint32_t up_to_warp[kWarps];
    const uint32_t warp = threadIdx.x / kWarp, lane = threadIdx.x % kWarp;
    // As many threads for each distance sum its scores, four at once.
    constexpr uint32_t kSharers = kThreads / kDistances, kEach = kScores / 4 / kSharers;
    const uint32_t distance = threadIdx.x / kSharers, sharer = threadIdx.x % kSharers;
    uint32_t sum = 0;
#pragma unroll
    for (uint32_t i = 0; i < kEach; ++i) {
        const uint4 four =
            reinterpret_cast<const uint4*>(counts + distance * kScores)[i * kSharers + sharer];
        sum += four.x + four.y + four.z + four.w;
    }
    for (int step = kSharers / 2; step > 0; step /= 2) sum += __shfl_xor_sync(kAllLanes, sum, step);
    if (sharer == 0) of_distance[distance] = sum;
    __syncthreads();
    if (warp == 0) {
        const uint32_t found =
            find_min_key(lane, static_cast<uint32_t>(constants.spacing),
                         static_cast<uint32_t>(constants.capacity), of_distance, counts);
        if (lane == 0) shared_min_key = found;
    }
    __syncthreads();
    const uint32_t min_key = shared_min_key;

    uint32_t before = 0;  // features of the runs that have been looked at
    for (uint32_t begin = 0; begin < runs; begin += kThreads) {
        const uint32_t run = begin + threadIdx.x;
        uint32_t flags = run < runs ? kept_of(keys + run * kLoads, min_key) : 0;
        const uint32_t own = static_cast<uint32_t>(__popc(flags)), up_to = sum_up_to(own, lane);
        if (lane == kWarp - 1) up_to_warp[warp] = up_to;
        __syncthreads();
        const uint32_t up_to_lanes_warp = sum_up_to(up_to_warp[lane], lane);
        const uint32_t before_warp =
            __shfl_sync(kAllLanes, up_to_lanes_warp, static_cast<int>(warp) - 1);
        for (uint32_t at = before + (warp > 0 ? before_warp : 0) + up_to - own; flags != 0;
             flags &= flags - 1)
            kept[at++] = kCells * run + static_cast<uint32_t>(__ffs(static_cast<int>(flags))) - 1;
        before += __shfl_sync(kAllLanes, up_to_lanes_warp, static_cast<int>(kWarps) - 1);
        __syncthreads();
    }
    if (threadIdx.x == 0) *feature_count = before;
}

}  // namespace

void record_orb_selection(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory) {
    const OrbConstants& constants = levels;  // all that the kernel reads of them
    recorder.launch(choose, {1, kThreads}, constants,
                    cover(static_cast<uint32_t>(levels.cells), kCells),
                    reinterpret_cast<const uint4*>(memory.keys), memory.counts, memory.kept,
                    memory.feature_count);
}
static_assert(kCells == kOrbKeysAtOnce);

}  // namespace defrec::cuda
