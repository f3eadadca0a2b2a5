// Stage orb, section 5 (docs/stages/orb.md): distances to stronger corners, and with them the keys
// by which section 6 chooses.
#include "backends/cuda/orb_steps.hpp"

namespace defrec::cuda {
namespace {

constexpr int kColumns = 8, kRows = 4;  // cells of a block
constexpr int kLanes = 8;               // that look round one cell
constexpr int kThreads = kColumns * kRows * kLanes;
using orb::kFarthest;

// Rings of cells that can hold a corner nearer than the farthest.
constexpr int rings_of(int cell) { return (kFarthest - 2) / cell + 1; }

// Corners as out 5 has them, 0: none.
__device__ int score_of(uint32_t corner) { return static_cast<int>(corner >> 16); }
__device__ int x_of(uint32_t corner) { return static_cast<int>(corner & 255); }
__device__ int y_of(uint32_t corner) { return static_cast<int>(corner >> 8 & 255); }

// A lane looks at every second cell of one of the ring's four sides; a ring has as many steps as
// its radius.
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

// kLanes for each cell; dynamic shared memory: the corners of the block's cells and of the rings
// round them.
__global__ void __launch_bounds__(kThreads)
    find_distances(OrbLevels levels, const uint32_t* corners, uint16_t* keys, uint8_t* distances,
                   uint32_t* counts) {
    uint32_t* const near_by = dynamic_shared<uint32_t>();
    const OrbLevel& level = levels.level[blockIdx.z];
    const int first_x = static_cast<int>(blockIdx.x) * kColumns,
              first_y = static_cast<int>(blockIdx.y) * kRows, cell = levels.cell;
    if (first_x >= level.cells_x || first_y >= level.cells_y) return;
    const int rings = rings_of(cell), stride = kColumns + 2 * rings,
              thread = static_cast<int>(threadIdx.x);
    for (int i = thread; i < stride * (kRows + 2 * rings); i += kThreads) {
        const int x = first_x - rings + i % stride, y = first_y - rings + i / stride;
        const bool inside = x >= 0 && y >= 0 && x < level.cells_x && y < level.cells_y;
        near_by[i] =
            inside ? corners[level.first_cell + static_cast<uint32_t>(y * level.cells_x + x)] : 0;
    }
    __syncthreads();

    const int lane = thread % kLanes, column = thread / kLanes % kColumns,
              row = thread / kLanes / kColumns;
    const uint32_t* const at = near_by + (row + rings) * stride + column + rings;
    const uint32_t own = *at;
    const Walk walk(lane);
    int nearest = kFarthest;
    for (int ring = 1;; ++ring) {
        const bool can_be_nearer = own != 0 && (ring - 1) * cell + 1 < nearest;
        if (__any_sync(kAllLanes, can_be_nearer) == 0) break;
        if (can_be_nearer)
            for (int k = walk.phase - ring; k < ring; k += 2) {
                const int dx = walk.along_x * k + walk.out_x * ring,
                          dy = walk.along_y * k + walk.out_y * ring;
                const uint32_t other = at[dy * stride + dx];
                const bool earlier = dy < 0 || (dy == 0 && dx < 0);
                const bool stronger = score_of(other) >= score_of(own) + (earlier ? 0 : 1);
                const int away_x = abs(cell * dx + x_of(other) - x_of(own)),
                          away_y = abs(cell * dy + y_of(other) - y_of(own));
                if (stronger) nearest = min(nearest, max(away_x, away_y));
            }
        for (int step = 1; step < kLanes; step *= 2)
            nearest = min(nearest, __shfl_xor_sync(kAllLanes, nearest, step));
    }
    if (lane != 0 || first_x + column >= level.cells_x || first_y + row >= level.cells_y) return;
    const uint32_t index =
        level.first_cell +
        static_cast<uint32_t>((first_y + row) * level.cells_x + first_x + column);
    const int distance = own != 0 ? nearest : 0;
    const uint32_t key = static_cast<uint32_t>(distance) << 8 | own >> 16;
    keys[index] = static_cast<uint16_t>(key);
    if (distances != nullptr) distances[index] = static_cast<uint8_t>(distance);
    if (key != 0) atomicAdd(counts + key, 1);
}

}  // namespace

void record_orb_distances(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory,
                          uint8_t* distances) {
    const OrbLevel& largest = levels.level[0];
    const int rings = rings_of(levels.cell);
    const dim3 blocks(cover(static_cast<uint32_t>(largest.cells_x), kColumns),
                      cover(static_cast<uint32_t>(largest.cells_y), kRows),
                      static_cast<uint32_t>(levels.levels));
    const size_t shared = sizeof(uint32_t) * static_cast<size_t>(kColumns + 2 * rings) *
                          static_cast<size_t>(kRows + 2 * rings);
    recorder.launch(find_distances, {blocks, kThreads, shared}, levels, memory.corners, memory.keys,
                    distances, memory.counts);
}

}  // namespace defrec::cuda
