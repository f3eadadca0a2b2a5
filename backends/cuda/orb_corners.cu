// Stage orb, sections 3 and 4 (docs/stages/orb.md): a block scores the pixels of its cells and
// finds each cell's corner, in one pass.
#include "backends/cuda/orb_score.cuh"
#include "backends/cuda/orb_steps.hpp"

namespace defrec::cuda {
namespace {

// A block has two halves of whole cells, one below the other. Its pixels are kept and scored in
// pairs, of the upper half's and the lower half's that lies at the same place.
constexpr int kWidth = 64, kHalf = 16;  // px, at most
constexpr int kThreads = 256, kWarps = kThreads / static_cast<int>(kWarp);
// Blocks of a multiprocessor at once. Older ones have no minimum of pairs and need more registers
// for it.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 900
constexpr int kResident = 3;
#else
constexpr int kResident = 6;
#endif
constexpr int kRowGroups = kThreads / kWidth;  // threads that share a column
constexpr int kRim = orb::kCircleRadius;
constexpr int kRowWords = (kWidth + 2 * kRim + 3 + 3) / 4,
              kRow = 4 * kRowWords;  // words of 4 px, wherever the first pixel lies in its word
constexpr int kRows = kHalf + 2 * kRim, kBothRows = 2 * kHalf + 2 * kRim;
constexpr int kMaskWords = 3;  // with a bit for each pixel of a row

struct Block {
    int x, y, half;      // the first pixel; rows of a half
    int across, down;    // cells of a half
    int cell_x, cell_y;  // the first cell
};
__device__ Block this_block(const OrbLevels& levels) {
    Block block;
    block.across = kWidth / levels.cell;
    block.down = kHalf / levels.cell;
    block.half = block.down * levels.cell;
    block.cell_x = static_cast<int>(blockIdx.x) * block.across;
    block.cell_y = static_cast<int>(blockIdx.y) * 2 * block.down;
    block.x = orb::kBorder + block.cell_x * levels.cell;
    block.y = orb::kBorder + block.cell_y * levels.cell;
    return block;
}

// pairs[row][column]: pixels with the rim; column 0 is the first pixel of the word that holds the
// rim's first.
__device__ void load_pairs(const OrbLevel& level, const Block& block, const uint8_t* pyramid,
                           uint4* pairs) {
    const auto* words = reinterpret_cast<const uint32_t*>(pyramid + level.first);
    const int stride = level.stride / 4, first_word = (block.x - kRim) / 4,
              first_row = block.y - kRim;
    for (int i = static_cast<int>(threadIdx.x); i < (block.half + 2 * kRim) * kRowWords;
         i += kThreads) {
        const int row = i / kRowWords, word = min(first_word + i % kRowWords, stride - 1);
        const uint32_t upper = words[min(first_row + row, level.height - 1) * stride + word];
        const uint32_t lower =
            words[min(first_row + row + block.half, level.height - 1) * stride + word];
        pairs[i] = make_uint4(__byte_perm(upper, lower, 0x4400) & 0x00ff00ff,
                              __byte_perm(upper, lower, 0x5511) & 0x00ff00ff,
                              __byte_perm(upper, lower, 0x6622) & 0x00ff00ff,
                              __byte_perm(upper, lower, 0x7733) & 0x00ff00ff);
    }
}

// A bit for each pixel of the block with its rim: whether it is usable.
__device__ void load_mask(const OrbLevel& level, const Block& block, const uint8_t* usable,
                          uint32_t (*mask)[kMaskWords]) {
    const int warp = static_cast<int>(threadIdx.x / kWarp),
              lane = static_cast<int>(threadIdx.x % kWarp);
    for (int row = warp; row < 2 * (block.half + kRim); row += kWarps) {
        const uint8_t* from =
            usable + level.first + min(block.y - kRim + row, level.height - 1) * level.stride;
        for (int word = 0; word < kMaskWords; ++word) {
            const int x =
                min(block.x - kRim + static_cast<int>(kWarp) * word + lane, level.width - 1);
            const uint32_t bits = __ballot_sync(kAllLanes, from[x] != 0);
            if (lane == 0) mask[row][word] = bits;
        }
    }
}

// A bit for each pixel of one row of the block: whether it may have a score.
__device__ uint64_t scored_pixels(const OrbLevel& level, const Block& block,
                                  const uint32_t (*mask)[kMaskWords], int row) {
    const int columns = level.width - orb::kBorder - block.x;
    if (block.y + row >= level.height - orb::kBorder || columns <= 0) return 0;
    const uint64_t in_level = columns < kWidth ? (uint64_t{1} << columns) - 1 : ~uint64_t{0};
    if (mask == nullptr) return in_level;
    uint64_t low = ~uint64_t{0};
    uint32_t high = ~0u;
    for (int i = 0; i <= 2 * kRim; ++i) {
        const uint32_t* bits = mask[row + i];
        low &= bits[0] | uint64_t{bits[1]} << 32;
        high &= bits[2];
    }
    uint64_t all = in_level & low;
    for (int i = 1; i <= 2 * kRim; ++i) all &= low >> i | uint64_t{high} << (64 - i);
    return all;
}

// Corners of a cell are compared by keys, score << 8 | (15 - y) << 4 | (15 - x): the largest is the
// strongest, then the first in raster order.
constexpr uint32_t kLastPlace = kOrbMaxCell - 1;
__device__ uint32_t place_key(int x, int y) {
    return (kLastPlace - static_cast<uint32_t>(y)) << 4 | (kLastPlace - static_cast<uint32_t>(x));
}
__device__ uint32_t corner_of(uint32_t key) {
    return key < 256
               ? 0
               : key >> 8 << 16 | (kLastPlace - (key >> 4 & 15)) << 8 | (kLastPlace - (key & 15));
}

// The part of a block that a thread scores: rows of one of its columns.
struct ColumnShare {
    int column, first_row, end_row;
};

// The best key of those rows of the column's cells.
__device__ uint32_t best_of_column(const OrbLevels& levels, const OrbLevel& level,
                                   const Block& block, const ColumnShare& share,
                                   const uint32_t* pairs, const uint32_t (*scored)[kWidth / 32],
                                   uint8_t* scores) {
    const int cell = levels.cell, column = share.column;
    const auto threshold = static_cast<uint32_t>(levels.threshold);
    uint32_t best = 0;
    const uint32_t bit = static_cast<uint32_t>(column) % 32;
    for (int row = share.first_row; row < share.end_row; ++row) {
        const uint32_t upper = scored[row][column / 32] >> bit & 1,
                       lower = scored[row + block.half][column / 32] >> bit & 1;
        if ((upper | lower) == 0) continue;
        const uint32_t* centre = pairs + (row + kRim) * kRow + (block.x - kRim) % 4 + kRim + column;
        uint32_t circle[16];
        load_circle<kRow>(centre, circle, std::make_index_sequence<16>());
        const uint32_t both = corner_scores(*centre, circle);
        const auto counting = [&](uint32_t score, uint32_t may) {
            return may != 0 && score > threshold ? score : 0;
        };
        const uint32_t upper_score = counting(both & 0xffff, upper),
                       lower_score = counting(both >> 16, lower);
        const uint32_t place = place_key(column % cell, row % cell);
        best = __vmaxu2(best, pair_of(upper_score != 0 ? upper_score << 8 | place : 0,
                                      lower_score != 0 ? lower_score << 8 | place : 0));
        if (scores == nullptr) continue;
        uint8_t* at = scores + level.first_pixel + (block.y + row) * level.width + block.x + column;
        if (upper_score != 0) at[0] = static_cast<uint8_t>(upper_score);
        if (lower_score != 0) at[block.half * level.width] = static_cast<uint8_t>(lower_score);
    }
    return best;
}

__global__ void __launch_bounds__(kThreads, kResident)
    find_corners(OrbLevels levels, const uint8_t* pyramid, const uint8_t* usable, uint32_t* corners,
                 uint8_t* scores) {
    __shared__ uint4 pair_words[kRows * kRowWords];
    __shared__ uint32_t mask[kBothRows][kMaskWords];
    __shared__ uint32_t scored[2 * kHalf][kWidth / 32];
    __shared__ uint32_t of_column[kRowGroups][kWidth];
    const auto* pairs = reinterpret_cast<const uint32_t*>(pair_words);
    const OrbLevel& level = levels.level[blockIdx.z];
    const Block block = this_block(levels);
    if (block.cell_x >= level.cells_x || block.cell_y >= level.cells_y) return;
    const int thread = static_cast<int>(threadIdx.x), cell = levels.cell;

    load_pairs(level, block, pyramid, pair_words);
    if (usable != nullptr) {
        load_mask(level, block, usable, mask);
        __syncthreads();
    }
    if (thread < 2 * block.half) {
        const uint64_t bits =
            scored_pixels(level, block, usable != nullptr ? mask : nullptr, thread);
        scored[thread][0] = static_cast<uint32_t>(bits);
        scored[thread][1] = static_cast<uint32_t>(bits >> 32);
    }
    __syncthreads();

    // The row groups share out the rows of cells, and where there are fewer of these, the rows
    // within.
    const int shares = kRowGroups / block.down, share = (cell + shares - 1) / shares;
    const int column = thread % kWidth, group = thread / kWidth, cell_row = group / shares;
    if (cell_row < block.down && column < block.across * cell) {
        const int first = group % shares * share, end = min(first + share, cell);
        of_column[group][column] = best_of_column(
            levels, level, block, {column, cell_row * cell + first, cell_row * cell + end}, pairs,
            scored, scores);
    }
    __syncthreads();
    if (thread >= block.across * block.down) return;
    const int x = thread % block.across, y = thread / block.across;
    uint32_t best = 0;
    for (int i = 0; i < shares; ++i)
        for (int k = 0; k < cell; ++k)
            best = __vmaxu2(best, of_column[y * shares + i][x * cell + k]);
    const auto keep = [&](int cell_y, uint32_t key) {
        if (block.cell_x + x < level.cells_x && cell_y < level.cells_y)
            corners[level.first_cell + static_cast<uint32_t>(cell_y * level.cells_x + block.cell_x +
                                                             x)] = corner_of(key);
    };
    keep(block.cell_y + y, best & 0xffff);
    keep(block.cell_y + block.down + y, best >> 16);
}

}  // namespace

void record_orb_corners(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory,
                        uint8_t* scores) {
    const int across = kWidth / levels.cell, down = 2 * (kHalf / levels.cell);
    const auto blocks = [](int cells, int side) {
        return cover(static_cast<uint32_t>(cells), static_cast<uint32_t>(side));
    };
    const OrbLevel& largest = levels.level[0];
    const dim3 grid(blocks(largest.cells_x, across), blocks(largest.cells_y, down),
                    static_cast<uint32_t>(levels.levels));
    recorder.launch(find_corners, {grid, kThreads}, levels, memory.pyramid,
                    memory.mask != nullptr ? memory.usable : nullptr, memory.corners, scores);
}

}  // namespace defrec::cuda
