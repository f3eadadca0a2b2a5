// Stage stereo at half resolution, sections 6 from the filling on, 7 and 8 up to the smoothing: a
// block fills the field of its tile of samples and of what lies round it, and refines it.
#include "backends/cuda/stereo_refine.cuh"
#include "backends/cuda/stereo_steps.hpp"

namespace defrec::cuda {
namespace {

using Level = DisparityPyramid::Level;

// For the runs of columns at a radius of 4, 39 x 4. A tile is low so that there are more blocks.
constexpr int kThreads = 160, kTileHeight = 8, kColumnRun = 2;

constexpr int kMaxPixels =
    512;  // of a top level that every block fills for itself, with what is coarser

__device__ int coarser_mean(int a, int b, int c, int d) {
    const int n =
        (a != kNoDisparity) + (b != kNoDisparity) + (c != kNoDisparity) + (d != kNoDisparity);
    const int sum = (a != kNoDisparity ? a : 0) + (b != kNoDisparity ? b : 0) +
                    (c != kNoDisparity ? c : 0) + (d != kNoDisparity ? d : 0);
    return n == 0 ? kNoDisparity : (2 * sum + n) / (2 * n);  // disparities are not negative
}

// The pixel (x, y) of the field that is coarser than fine. fine may not reach as far as 2 x 2
// pixels do.
__device__ int coarser(const int16_t* fine, const Level& size, int x, int y) {
    const int u = 2 * x, v = 2 * y, u2 = u + 1, v2 = v + 1;
    const auto at = [&](int i, int j) {
        return i < size.width && j < size.height ? int{fine[j * size.width + i]} : kNoDisparity;
    };
    return coarser_mean(at(u, v), at(u2, v), at(u, v2), at(u2, v2));
}

// What a hole at (x, y) gets from the coarser field, in a window of it that begins at (first_x,
// first_y) with rows `stride` apart. Without any disparity it stays one: the mean of those that say
// so is kNoDisparity.
__device__ int from_coarser(const int16_t* window, int stride, int first_x, int first_y,
                            const Level& size, int x, int y) {
    const auto at = [&](int u, int v) {
        return int{window[(clamped(v, 0, size.height - 1) - first_y) * stride +
                          clamped(u, 0, size.width - 1) - first_x]};
    };
    const int u = x >> 1, v = y >> 1, u2 = (x & 1) == 0 ? u - 1 : u + 1,
              v2 = (y & 1) == 0 ? v - 1 : v + 1;
    return (9 * at(u, v) + 3 * at(u2, v) + 3 * at(u, v2) + at(u2, v2) + 8) >> 4;
}

// Makes the fields that are coarser than `top`, behind it in memory, and fills them all. By all
// threads of a block; no field has a gap.
__device__ void fill_from(const DisparityPyramid& pyramid, int top, int16_t* memory) {
    const int first = pyramid.levels[top].offset, thread = static_cast<int>(threadIdx.x),
              threads = static_cast<int>(blockDim.x);
    const auto field = [&](int level) { return memory + (pyramid.levels[level].offset - first); };
    for (int level = top + 1; level < pyramid.count; ++level) {
        const Level &fine = pyramid.levels[level - 1], &size = pyramid.levels[level];
        for (int i = thread; i < size.width * size.height; i += threads)
            field(level)[i] = static_cast<int16_t>(
                coarser(field(level - 1), fine, i % size.width, i / size.width));
        __syncthreads();
    }
    for (int level = pyramid.count - 2; level >= top; --level) {
        const Level &size = pyramid.levels[level], &coarse = pyramid.levels[level + 1];
        for (int i = thread; i < size.width * size.height; i += threads)
            if (field(level)[i] == kNoDisparity)
                field(level)[i] = static_cast<int16_t>(from_coarser(
                    field(level + 1), coarse.width, 0, 0, coarse, i % size.width, i / size.width));
        __syncthreads();
    }
}

// For top levels too large for shared memory: one block.
constexpr int kFillThreads = 1024;
__global__ void __launch_bounds__(kFillThreads) fill_top(DisparityPyramid pyramid, int top) {
    fill_from(pyramid, top, pyramid.data + pyramid.levels[top].offset);
}

// What a block needs of the fields: a window of each level up to kTiledLevels, whose sides follow
// from that of the finest. Beyond a field's ends they repeat them.
struct Windows {
    int width[kTiledLevels + 1], height[kTiledLevels + 1], first[kTiledLevels + 1], cells;
};
constexpr Windows windows_of(int width, int height) {
    Windows windows{};
    for (int level = 0; level <= kTiledLevels; ++level) {
        windows.width[level] = width;
        windows.height[level] = height;
        windows.first[level] = windows.cells;
        windows.cells += width * height;
        width = width / 2 + 3;
        height = height / 2 + 3;
    }
    return windows;
}

template <int kRadius>
struct Block {
    // What a block fills round its tile: as far as windows and standing reach.
    static constexpr int kMargin = std::max((kRadius + 1) / 2, kEdgeRadius);
    static constexpr Windows kWindows =
        windows_of(kTileWidth + 2 * kMargin, kTileHeight + 2 * kMargin);
    RefineTile<kRadius, kTileHeight> tile;
    uint32_t holes[kThreads / kWarp];  // of each warp: a bit for each level with holes
    int16_t fields[kWindows.cells];
    int16_t top[2 * kMaxPixels];  // the whole top level with what is coarser
};

// The first pixels of the windows in their fields.
struct WindowStarts {
    int x[kTiledLevels + 1], y[kTiledLevels + 1];

    __device__ __forceinline__ WindowStarts(int left, int top) {
        x[0] = left;
        y[0] = top;
#pragma unroll
        for (int level = 1; level <= kTiledLevels; ++level) {
            x[level] = (x[level - 1] >> 1) - 1;
            y[level] = (y[level - 1] >> 1) - 1;
        }
    }
};

// The values that a thread reads of the windows and of the top level.
template <int kRadius>
struct Cells {
    static constexpr Windows kWindows = Block<kRadius>::kWindows;
    static constexpr int kMaxRounds =
                             (kWindows.width[0] * kWindows.height[0] + kThreads - 1) / kThreads,
                         kTopRounds = (kMaxPixels + kThreads - 1) / kThreads;
    int windows[kTiledLevels + 1][kMaxRounds], top[kTopRounds];
};

template <int kRadius>
__device__ __forceinline__ void read_cells(const DisparityPyramid& pyramid,
                                           const WindowStarts& starts, int top_pixels,
                                           Cells<kRadius>& cells) {
    constexpr Windows kWindows = Cells<kRadius>::kWindows;
    const int thread = static_cast<int>(threadIdx.x);
#pragma unroll
    for (int level = 0; level <= kTiledLevels; ++level) {
        const int width = kWindows.width[level], count = width * kWindows.height[level];
        // For a level that there is not, it reads some sample that does not matter.
        const Level& size = pyramid.levels[level];
#pragma unroll
        for (int round = 0; round < Cells<kRadius>::kMaxRounds; ++round) {
            if (round * kThreads >= count) break;
            const int i = min(thread + round * kThreads, count - 1),
                      x = clamped(starts.x[level] + i % width, 0, size.width - 1),
                      y = clamped(starts.y[level] + i / width, 0, size.height - 1);
            cells.windows[level][round] = __ldg(pyramid.data + size.offset + y * size.width + x);
        }
    }
    const int top_offset = pyramid.levels[top_level(pyramid)].offset;
#pragma unroll
    for (int round = 0; round < Cells<kRadius>::kTopRounds; ++round) {
        const int i = thread + round * kThreads;
        cells.top[round] = i < top_pixels ? __ldg(pyramid.data + top_offset + i) : 0;
    }
}

// Keeps them for the block; returns a bit for each level with a hole among them.
template <int kRadius>
__device__ __forceinline__ uint32_t keep_cells(const Cells<kRadius>& cells, int top_level,
                                               int top_pixels, Block<kRadius>& block) {
    constexpr Windows kWindows = Cells<kRadius>::kWindows;
    const int thread = static_cast<int>(threadIdx.x);
    uint32_t seen = 0;
#pragma unroll
    for (int level = 0; level <= kTiledLevels; ++level) {
        const int count = kWindows.width[level] * kWindows.height[level];
#pragma unroll
        for (int round = 0; round < Cells<kRadius>::kMaxRounds; ++round) {
            if (round * kThreads >= count) break;
            const int i = thread + round * kThreads, cell = cells.windows[level][round];
            if (i < count) block.fields[kWindows.first[level] + i] = static_cast<int16_t>(cell);
            if (cell == kNoDisparity) seen |= 1u << level;
        }
    }
#pragma unroll
    for (int round = 0; round < Cells<kRadius>::kTopRounds; ++round) {
        const int i = thread + round * kThreads;
        if (i < top_pixels) block.top[i] = static_cast<int16_t>(cells.top[round]);
        if (cells.top[round] == kNoDisparity) seen |= 1u << top_level;
    }
    return seen;
}

// The first level without holes, from those that each thread has seen: the coarsest that is needed.
template <int kRadius>
__device__ __forceinline__ int first_without_holes(uint32_t seen, Block<kRadius>& block) {
    uint32_t in_warp = 0;
#pragma unroll
    for (int level = 0; level <= kTiledLevels; ++level)
        if (__any_sync(kAllLanes, (seen >> level & 1) != 0) != 0) in_warp |= 1u << level;
    block.holes[threadIdx.x / kWarp] = in_warp;
    __syncthreads();
    uint32_t all = 0;
#pragma unroll
    for (const uint32_t of_warp : block.holes) all |= of_warp;
    return __ffs(static_cast<int>(~all)) - 1;
}

// Fills the window of the finest field that begins at (left, top). whole: the top level is not
// filled yet.
template <int kRadius>
__device__ __forceinline__ void fill_window(const DisparityPyramid& pyramid, int left, int top,
                                            bool whole, Block<kRadius>& block) {
    constexpr Windows kWindows = Block<kRadius>::kWindows;
    const int thread = static_cast<int>(threadIdx.x), top_level = cuda::top_level(pyramid);
    const WindowStarts starts(left, top);
    const Level& top_size = pyramid.levels[top_level];
    const int top_pixels = whole ? top_size.width * top_size.height : 0;
    // All reads before anything that waits for one.
    Cells<kRadius> cells;
    read_cells(pyramid, starts, top_pixels, cells);
    const int with_holes =
        first_without_holes(keep_cells(cells, top_level, top_pixels, block), block);
    if (whole && top_level < with_holes) fill_from(pyramid, top_level, block.top);
#pragma unroll
    for (int level = kTiledLevels - 1; level >= 0; --level) {
        if (level >= with_holes || level >= top_level) continue;
        const bool from_whole = whole && level + 1 == top_level;
        const Level& size = pyramid.levels[level + 1];
        int16_t* const field = block.fields + kWindows.first[level];
        const int16_t* const from =
            from_whole ? block.top : block.fields + kWindows.first[level + 1];
        const int stride = from_whole ? size.width : kWindows.width[level + 1],
                  from_x = from_whole ? 0 : starts.x[level + 1],
                  from_y = from_whole ? 0 : starts.y[level + 1];
        for (int i = thread; i < kWindows.width[level] * kWindows.height[level]; i += kThreads) {
            if (field[i] != kNoDisparity) continue;
            const int x = clamped(starts.x[level] + i % kWindows.width[level], 0,
                                  pyramid.levels[level].width - 1),
                      y = clamped(starts.y[level] + i / kWindows.width[level], 0,
                                  pyramid.levels[level].height - 1);
            field[i] = static_cast<int16_t>(from_coarser(from, stride, from_x, from_y, size, x, y));
        }
        __syncthreads();
    }
}

template <int kRadius>
__global__ void __launch_bounds__(kThreads, 3) make_dense(DenseStep step, bool whole) {
    constexpr int kMargin = Block<kRadius>::kMargin;
    Block<kRadius>& block = *dynamic_shared<Block<kRadius>>();
    auto& tile = block.tile;
    const StereoShape& shape = step.shape;
    const int width = shape.half_samples_x, height = shape.half_samples_y,
              thread = static_cast<int>(threadIdx.x);
    const int left = static_cast<int>(blockIdx.x) * kTileWidth,
              top = static_cast<int>(blockIdx.y) * kTileHeight;
    fill_window(step.pyramid, left - kMargin, top - kMargin, whole, block);
    // From the tile's first sample on; beyond the field's ends they are repeated.
    const auto dense = [&](int column, int row) {
        constexpr int kStride = Block<kRadius>::kWindows.width[0];
        return int{block.fields[(row + kMargin) * kStride + column + kMargin]};
    };

    const GrayPair images{step.left, step.right, shape.half_width, shape.half_height,
                          gray_stride(shape.half_stride)};
    make_pairs<kThreads>(tile, images, left, top, [&](int tile_x, int tile_y, int(&two)[2]) {
        const int u = tile_x >> 1, u2 = (tile_x + 1) >> 1, v = max(tile_y >> 1, -kMargin),
                  v2 = (tile_y + 1) >> 1;
        const int above = dense(u, v) + dense(u2, v), below = dense(u, v2) + dense(u2, v2);
        // Without any disparity any will do.
        two[0] = max((above + below + 2) >> 2, 0);
        two[1] = max((below + 1) >> 1, 0);
    });
    for (int k = thread; k < kTileWidth * kTileHeight; k += kThreads) {
        const int column = k % kTileWidth, row = k / kTileWidth, i = left + column, j = top + row;
        if (i >= width || j >= height) continue;
        const int at = j * width + i, here = dense(column, row);
        const bool supported = __ldg(step.supported + at) != kNoDisparity;
        int lowest = here, highest = here;
#pragma unroll
        for (int v = -kEdgeRadius; v <= kEdgeRadius; ++v)
#pragma unroll
            for (int u = -kEdgeRadius; u <= kEdgeRadius; ++u) {
                const int disparity = dense(column + u, row + v);
                lowest = min(lowest, disparity);
                highest = max(highest, disparity);
            }
        const bool open = highest - lowest > shape.edge || !supported;
        step.standing[at] = here - lowest > shape.edge ? kDoubtful : open ? kOpen : kSettled;
        if (step.dense != nullptr) step.dense[at] = static_cast<int16_t>(here);
    }
    __syncthreads();
    sum_columns<kThreads, kColumnRun>(tile);
    __syncthreads();
    for (int k = thread; k < kTileWidth * kTileHeight; k += kThreads) {
        const int column = k % kTileWidth, row = k / kTileWidth, i = left + column, j = top + row;
        if (i >= width || j >= height) continue;
        Refined refined[1];
        refine_run<1>(tile, images, column, row, 2 * i, 2 * j, refined);
        const int here = dense(column, row);
        step.refined[j * width + i] = static_cast<int16_t>(
            here == kNoDisparity ? kNoDisparity : moved(here, refined[0].move));
    }
}

}  // namespace

void record_dense(Recorder& recorder, const DenseStep& step) {
    const int top = top_level(step.pyramid);
    // A field of a single sample is not a coarser one for any.
    const bool whole =
        top > 0 && step.pyramid.levels[top].width * step.pyramid.levels[top].height <= kMaxPixels;
    if (!whole) recorder.launch(fill_top, {dim3(1), dim3(kFillThreads)}, step.pyramid, top);
    const auto columns = static_cast<uint32_t>(step.shape.half_samples_x),
               rows = static_cast<uint32_t>(step.shape.half_samples_y);
    const dim3 blocks(cover(columns, kTileWidth), cover(rows, kTileHeight));
    with_radius(step.shape.radius, [&]<int kRadius>(std::integral_constant<int, kRadius>) {
        recorder.launch(make_dense<kRadius>, {blocks, dim3(kThreads), sizeof(Block<kRadius>)}, step,
                        whole);
    });
}

}  // namespace defrec::cuda
