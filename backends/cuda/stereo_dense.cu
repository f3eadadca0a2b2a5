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

// A part of a field: pixels x0 .. x1 - 1 and y0 .. y1 - 1, without gaps.
struct Part {
    int x0, y0, x1, y1;
    __device__ int width() const { return x1 - x0; }
    __device__ int pixels() const { return (x1 - x0) * (y1 - y0); }
    // visit(x, y, index) for every pixel, by the threads of the block: sixteen to a row.
    template <class Visit>
    __device__ __forceinline__ void each(Visit&& visit) const {
        constexpr int kLanes = 16;
        const int lane = static_cast<int>(threadIdx.x) % kLanes,
                  first = static_cast<int>(threadIdx.x) / kLanes;
        const int rows = static_cast<int>(blockDim.x) / kLanes;
#pragma unroll 4
        for (int y = y0 + first; y < y1; y += rows)
            for (int x = x0 + lane; x < x1; x += kLanes) visit(x, y, (y - y0) * width() + x - x0);
    }
};

// Most pixels of the parts of all levels that a block needs, whose finest has these sides.
constexpr int max_pixels(int width, int height) {
    int sum = 0;
    for (int level = 0; level < kTiledLevels; ++level) {
        sum += width * height;
        width = width / 2 + 3;
        height = height / 2 + 3;
    }
    return sum + std::max(width * height, 2 * kMaxPixels);
}

// Fills the pixels of `part` of the finest field: memory begins with them. whole: the top level is
// not filled yet. holes: a bit for each level whose part has holes, for each warp.
__device__ void fill_part(const DisparityPyramid& pyramid, const Part& part, bool whole,
                          int16_t* memory, uint32_t (&holes)[kThreads / kWarp]) {
    const int top = top_level(pyramid);
    Part parts[kTiledLevels + 1];
    int first[kTiledLevels + 1];
    uint32_t seen = 0;
    parts[0] = part;
    first[0] = 0;
#pragma unroll
    for (int level = 0; level <= kTiledLevels; ++level) {
        if (level > top) break;
        const Level& size = pyramid.levels[level];
        if (level > 0) {
            const Part& fine = parts[level - 1];
            parts[level] = {max(0, (fine.x0 >> 1) - 1), max(0, (fine.y0 >> 1) - 1),
                            min(size.width, ((fine.x1 - 1) >> 1) + 2),
                            min(size.height, ((fine.y1 - 1) >> 1) + 2)};
            if (level == top && whole) parts[level] = {0, 0, size.width, size.height};
            first[level] = first[level - 1] + fine.pixels();
        }
        const int16_t* const from = pyramid.data + size.offset;
        int16_t* const to = memory + first[level];
        parts[level].each([&](int x, int y, int i) {
            const int16_t disparity = from[y * size.width + x];
            to[i] = disparity;
            if (disparity == kNoDisparity) seen |= 1u << level;
        });
    }
    uint32_t in_warp = 0;
#pragma unroll
    for (int level = 0; level <= kTiledLevels; ++level)
        if (__any_sync(kAllLanes, (seen >> level & 1) != 0) != 0) in_warp |= 1u << level;
    holes[threadIdx.x / kWarp] = in_warp;
    __syncthreads();
    uint32_t all = 0;
#pragma unroll
    for (const uint32_t of_warp : holes) all |= of_warp;
    // The coarsest level that is needed is the first without holes.
    const int with_holes = __ffs(static_cast<int>(~all)) - 1;
#pragma unroll
    for (int level = kTiledLevels; level >= 0; --level) {
        if (level >= with_holes) continue;
        if (level == top) {
            if (whole) fill_from(pyramid, top, memory + first[level]);
            continue;
        }
        const Part &fine = parts[level], &coarse = parts[level < kTiledLevels ? level + 1 : level];
        const Level& size = pyramid.levels[level + 1];
        int16_t* const field = memory + first[level];
        const int16_t* const from = field + fine.pixels();
        fine.each([&](int x, int y, int i) {
            if (field[i] == kNoDisparity)
                field[i] = static_cast<int16_t>(
                    from_coarser(from, coarse.width(), coarse.x0, coarse.y0, size, x, y));
        });
        __syncthreads();
    }
}

template <int kRadius>
struct Block {
    // What a block fills round its tile: as far as windows and standing reach.
    static constexpr int kMargin = std::max((kRadius + 1) / 2, kEdgeRadius);
    RefineTile<kRadius, kTileHeight> tile;
    uint32_t holes[kThreads / kWarp];
    int16_t fields[max_pixels(kTileWidth + 2 * kMargin, kTileHeight + 2 * kMargin)];
};

template <int kRadius>
__global__ void __launch_bounds__(kThreads, 3) make_dense(DenseStep step, bool whole) {
    using Tile = RefineTile<kRadius, kTileHeight>;
    constexpr int kMargin = Block<kRadius>::kMargin;
    Block<kRadius>& block = *dynamic_shared<Block<kRadius>>();
    auto& tile = block.tile;
    auto& fields = block.fields;
    const StereoShape& shape = step.shape;
    const int width = shape.half_samples_x, height = shape.half_samples_y,
              thread = static_cast<int>(threadIdx.x);
    const int left = static_cast<int>(blockIdx.x) * kTileWidth,
              top = static_cast<int>(blockIdx.y) * kTileHeight;
    const Part part{max(0, left - kMargin), max(0, top - kMargin),
                    min(width, left + kTileWidth + kMargin),
                    min(height, top + kTileHeight + kMargin)};
    fill_part(step.pyramid, part, whole, fields, block.holes);
    const auto dense = [&](int i, int j) {
        return int{fields[(j - part.y0) * part.width() + i - part.x0]};
    };

    const GrayPair images{step.left, step.right, shape.half_width, shape.half_height,
                          gray_stride(shape.half_stride)};
#pragma unroll 3
    for (int i = thread; i < Tile::kPairs * Tile::kColumns; i += kThreads) {
        const int column = i % Tile::kColumns, pair = i / Tile::kColumns,
                  x = 2 * left - kRadius + column, y = 2 * top + Tile::kFirstRow + 2 * pair;
        const int u = clamped(x >> 1, part.x0, part.x1 - 1),
                  u2 = clamped((x + 1) >> 1, part.x0, part.x1 - 1),
                  v = clamped(y >> 1, part.y0, part.y1 - 1),
                  v2 = clamped((y + 1) >> 1, part.y0, part.y1 - 1);
        const int above = dense(u, v) + dense(u2, v), below = dense(u, v2) + dense(u2, v2);
        tile.pairs[pair][column] =
            refine_pair(images, x, y, {(above + below + 2) >> 2, (below + 1) >> 1});
    }
    for (int k = thread; k < kTileWidth * kTileHeight; k += kThreads) {
        const int i = left + k % kTileWidth, j = top + k / kTileWidth;
        if (i >= width || j >= height) continue;
        const int here = dense(i, j);
        int lowest = here, highest = here;
#pragma unroll
        for (int v = -kEdgeRadius; v <= kEdgeRadius; ++v)
#pragma unroll
            for (int u = -kEdgeRadius; u <= kEdgeRadius; ++u) {
                const int disparity =
                    dense(clamped(i + u, 0, width - 1), clamped(j + v, 0, height - 1));
                lowest = min(lowest, disparity);
                highest = max(highest, disparity);
            }
        const int at = j * width + i;
        const bool open =
            highest - lowest > shape.edge || __ldg(step.supported + at) == kNoDisparity;
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
        refine_run<1>(tile, column, row, 2 * i, 2 * j, shape.half_width, shape.half_height,
                      refined);
        const int here = dense(i, j);
        step.refined[j * width + i] = static_cast<int16_t>(
            here == kNoDisparity ? kNoDisparity : moved(here, refined[0].move));
    }
}

}  // namespace

void record_dense(Recorder& recorder, const DenseStep& step) {
    const int top = top_level(step.pyramid);
    const bool whole =
        step.pyramid.levels[top].width * step.pyramid.levels[top].height <= kMaxPixels;
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
