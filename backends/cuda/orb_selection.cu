// Stage orb, sections 5 and 6 (docs/stages/orb.md): distances to stronger corners, and the choice of those that are kept.
#include "backends/cuda/orb_steps.hpp"

namespace defrec::cuda {
namespace {

// ---- distances -----------------------------------------------------------------------------------------------------

constexpr int kColumns = 8, kRows = 4;  // cells of a block
constexpr int kLanes = 8;               // that look round one cell
constexpr int kDistanceThreads = kColumns * kRows * kLanes;
constexpr int kFarthest = static_cast<int>(orb::kFarthest);

// Rings of cells that can hold a corner nearer than the farthest.
constexpr int rings_of(int cell) { return (kFarthest - 2) / cell + 1; }

// Corners as out 5 has them, 0: none.
__device__ int score_of(uint32_t corner) { return static_cast<int>(corner >> 16); }
__device__ int x_of(uint32_t corner) { return static_cast<int>(corner & 255); }
__device__ int y_of(uint32_t corner) { return static_cast<int>(corner >> 8 & 255); }

// Of the ring's four sides a lane looks at every second cell of one; a ring has as many steps as its radius.
struct Walk {
    int along_x, along_y, out_x, out_y, phase;
    __device__ explicit Walk(int lane) : phase(lane / 4) {
        const int side = lane % 4;
        along_x = side == 0 ? 1 : side == 2 ? -1 : 0;
        along_y = side == 1 ? 1 : side == 3 ? -1 : 0;
        out_x = along_y;
        out_y = -along_x;
    }
};

// Eight lanes for each cell; dynamic shared memory: the corners of the block's cells and of the rings round them.
__global__ void __launch_bounds__(kDistanceThreads) find_distances(OrbLevels levels, const uint32_t* corners, uint8_t* distances,
                                                                   uint8_t* copy, uint32_t* counts) {
    uint32_t* const near_by = dynamic_shared<uint32_t>();
    const OrbLevel& level = levels.level[blockIdx.z];
    const int first_x = static_cast<int>(blockIdx.x) * kColumns, first_y = static_cast<int>(blockIdx.y) * kRows, cell = levels.cell;
    if (first_x >= level.cells_x || first_y >= level.cells_y) return;
    const int rings = rings_of(cell), stride = kColumns + 2 * rings, thread = static_cast<int>(threadIdx.x);
    for (int i = thread; i < stride * (kRows + 2 * rings); i += kDistanceThreads) {
        const int x = first_x - rings + i % stride, y = first_y - rings + i / stride;
        const bool inside = x >= 0 && y >= 0 && x < level.cells_x && y < level.cells_y;
        near_by[i] = inside ? corners[level.first_cell + static_cast<uint32_t>(y * level.cells_x + x)] : 0;
    }
    __syncthreads();

    const int lane = thread % kLanes, column = thread / kLanes % kColumns, row = thread / kLanes / kColumns;
    const uint32_t* const at = near_by + (row + rings) * stride + column + rings;
    const uint32_t own = *at;
    const Walk walk(lane);
    int nearest = kFarthest;
    for (int ring = 1;; ++ring) {
        const bool can_be_nearer = own != 0 && (ring - 1) * cell + 1 < nearest;
        if (__any_sync(kAllLanes, can_be_nearer) == 0) break;
        if (can_be_nearer)
            for (int k = walk.phase - ring; k < ring; k += 2) {
                const int dx = walk.along_x * k + walk.out_x * ring, dy = walk.along_y * k + walk.out_y * ring;
                const uint32_t other = at[dy * stride + dx];
                const bool earlier = dy < 0 || (dy == 0 && dx < 0);
                const bool stronger = score_of(other) >= score_of(own) + (earlier ? 0 : 1);
                const int away_x = abs(cell * dx + x_of(other) - x_of(own)), away_y = abs(cell * dy + y_of(other) - y_of(own));
                if (stronger) nearest = min(nearest, max(away_x, away_y));
            }
        for (int step = 1; step < kLanes; step *= 2) nearest = min(nearest, __shfl_xor_sync(kAllLanes, nearest, step));
    }
    if (lane != 0 || first_x + column >= level.cells_x || first_y + row >= level.cells_y) return;
    const uint32_t index = level.first_cell + static_cast<uint32_t>((first_y + row) * level.cells_x + first_x + column);
    const int distance = own != 0 ? nearest : 0;
    distances[index] = static_cast<uint8_t>(distance);
    if (copy != nullptr) copy[index] = static_cast<uint8_t>(distance);
    if (own != 0) atomicAdd(counts + static_cast<uint32_t>(distance) * kOrbScores + (own >> 16), 1);
}

// ---- selection -----------------------------------------------------------------------------------------------------

constexpr uint32_t kThreads = 1024, kWarps = kThreads / kWarp;

__device__ uint32_t sum_of_warp(uint32_t value) {
    for (int step = 16; step > 0; step /= 2) value += __shfl_xor_sync(kAllLanes, value, step);
    return value;
}
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

// Corners with at least this distance are kept, and of those with one less those with at least this score.
struct Limits {
    uint32_t distance, score;
};

// By one warp. of_distance: numbers of corners.
__device__ Limits find_limits(uint32_t lane, uint32_t spacing, uint32_t capacity, const uint32_t* of_distance, const uint32_t* counts) {
    // The number with at least a distance falls as the distance grows: the first that fits is the least.
    const uint32_t far = sum_from(of_distance[kWarp + lane], lane);
    const uint32_t near = sum_from(of_distance[lane], lane) + __shfl_sync(kAllLanes, far, 0);
    const uint32_t fits_near = __ballot_sync(kAllLanes, lane >= spacing && near <= capacity);
    const uint32_t fits_far = __ballot_sync(kAllLanes, kWarp + lane >= spacing && far <= capacity);
    Limits limits{kOrbDistances, kOrbScores};
    if (fits_near != 0) {
        limits.distance = static_cast<uint32_t>(__ffs(static_cast<int>(fits_near))) - 1;
    } else if (fits_far != 0) {
        limits.distance = kWarp + static_cast<uint32_t>(__ffs(static_cast<int>(fits_far))) - 1;
    }
    if (limits.distance == spacing) return limits;

    const uint32_t kept_near = __shfl_sync(kAllLanes, near, static_cast<int>(limits.distance % kWarp));
    const uint32_t kept_far = __shfl_sync(kAllLanes, far, static_cast<int>(limits.distance % kWarp));
    const uint32_t kept = limits.distance < kWarp ? kept_near : limits.distance < kOrbDistances ? kept_far : 0;
    // The same by score.
    constexpr uint32_t kEach = kOrbScores / kWarp;
    uint32_t of_score[kEach], sum = 0;
    for (uint32_t i = 0; i < kEach; ++i) {
        of_score[i] = counts[(limits.distance - 1) * kOrbScores + kEach * lane + i];
        sum += of_score[i];
    }
    uint32_t at_least = kept + sum_from(sum, lane) - sum;
    uint32_t least = kOrbScores;
    for (uint32_t i = kEach; i-- > 0;) {
        at_least += of_score[i];
        if (at_least <= capacity) least = kEach * lane + i;
    }
    for (int step = 16; step > 0; step /= 2) least = min(least, __shfl_xor_sync(kAllLanes, least, step));
    limits.score = max(least, 1u);
    return limits;
}

// Four cells' flags; those behind the last have distance 0.
__device__ uint32_t kept_of(uint32_t word, uint32_t four_distances, const Limits& limits, const uint32_t* corners) {
    uint32_t kept = 0;
    for (uint32_t i = 0; i < 4; ++i) {
        const uint32_t distance = four_distances >> (8 * i) & 255;
        bool keep = distance >= limits.distance;
        if (distance != 0 && distance + 1 == limits.distance) keep = corners[4 * word + i] >> 16 >= limits.score;
        kept |= keep ? 1u << i : 0;
    }
    return kept;
}

// One block. Each warp has a run of words of four cells: it counts, and when all have counted, writes what it keeps.
__global__ void __launch_bounds__(kThreads) choose(uint32_t spacing, uint32_t capacity, uint32_t words, const uint32_t* corners,
                                                   const uint32_t* distances, const uint32_t* counts, uint32_t* kept,
                                                   uint32_t* feature_count) {
    __shared__ uint32_t of_distance[kOrbDistances];
    __shared__ Limits shared_limits;
    __shared__ uint32_t up_to_warp[kWarps];
    const uint32_t warp = threadIdx.x / kWarp, lane = threadIdx.x % kWarp;
    for (uint32_t distance = warp; distance < kOrbDistances; distance += kWarps) {
        uint32_t sum = 0;
        for (uint32_t score = lane; score < kOrbScores; score += kWarp) sum += counts[distance * kOrbScores + score];
        sum = sum_of_warp(sum);
        if (lane == 0) of_distance[distance] = sum;
    }
    __syncthreads();
    if (warp == 0) {
        const Limits found = find_limits(lane, spacing, capacity, of_distance, counts);
        if (lane == 0) shared_limits = found;
    }
    __syncthreads();
    const Limits limits = shared_limits;

    const uint32_t share = (words + kThreads - 1) / kThreads * kWarp;
    const uint32_t first = min(warp * share, words), end = min(first + share, words);
    uint32_t count = 0;
    for (uint32_t word = first + lane; word < end; word += kWarp)
        count += static_cast<uint32_t>(__popc(kept_of(word, distances[word], limits, corners)));
    count = sum_of_warp(count);
    if (lane == 0) up_to_warp[warp] = count;
    __syncthreads();
    if (warp == 0) {
        const uint32_t sum = sum_up_to(up_to_warp[lane], lane);
        up_to_warp[lane] = sum;
        if (lane == kWarps - 1) *feature_count = sum;
    }
    __syncthreads();
    uint32_t next = up_to_warp[warp] - count;
    for (uint32_t begin = first; begin < end; begin += kWarp) {
        const uint32_t word = begin + lane;
        const uint32_t flags = word < end ? kept_of(word, distances[word], limits, corners) : 0;
        const uint32_t own = static_cast<uint32_t>(__popc(flags)), up_to = sum_up_to(own, lane);
        uint32_t at = next + up_to - own;
        for (uint32_t i = 0; i < 4; ++i)
            if ((flags >> i & 1) != 0) kept[at++] = 4 * word + i;
        next += __shfl_sync(kAllLanes, up_to, kWarp - 1);
    }
}
static_assert(kWarps == kWarp && kOrbDistances == 2 * kWarp);

}  // namespace

void record_orb_distances(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory, uint8_t* distances) {
    const OrbLevel& largest = levels.level[0];
    const int rings = rings_of(levels.cell);
    const dim3 blocks(cover(static_cast<uint32_t>(largest.cells_x), kColumns), cover(static_cast<uint32_t>(largest.cells_y), kRows),
                      static_cast<uint32_t>(levels.count));
    const size_t shared = sizeof(uint32_t) * static_cast<size_t>(kColumns + 2 * rings) * static_cast<size_t>(kRows + 2 * rings);
    recorder.launch(find_distances, {blocks, kDistanceThreads, shared}, levels, memory.corners, memory.distances, distances, memory.counts);
}

void record_orb_selection(Recorder& recorder, const defrec_orb_params& params, uint32_t cells, const OrbMemory& memory) {
    recorder.launch(choose, {1, kThreads}, params.spacing, params.capacity, cover(cells, 4), memory.corners,
                    reinterpret_cast<const uint32_t*>(memory.distances), memory.counts, memory.kept, memory.feature_count);
}

}  // namespace defrec::cuda
