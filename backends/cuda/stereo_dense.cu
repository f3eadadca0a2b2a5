// Stage stereo at half resolution, sections 6 from the filling on, 7 and 8: a block fills the field
// of its tile and of what lies round it, refines it and smooths the result.
#include "backends/cuda/stereo_refine.cuh"
#include "backends/cuda/stereo_smooth.cuh"
#include "backends/cuda/stereo_steps.hpp"

namespace defrec::cuda {
namespace {

using Level = DisparityPyramid::Level;

// For the runs of columns of two images at a radius of 4, 2 x 40 x 4. At 480 x 270 there are fewer
// blocks than two for each multiprocessor.
constexpr int kThreads = 320;

constexpr int kMaxPixels =
    512;  // of a top level that every block fills for itself, with what is coarser
constexpr int kOwned = kRefineTile - 2 * kHalfSmoothRadius;  // side of what a block is there for
constexpr int kRun = 4, kLine = kRun + 2 * kHalfSmoothRadius;
static_assert(kOwned % kRun == 0 && kRefineTile % kRun == 0);

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

// Most pixels of the parts of all levels that a block needs.
template <int kRadius>
constexpr int max_pixels() {
    int side = RefineTile<kRadius>::kSide, sum = 0;
    for (int level = 0; level < kTiledLevels; ++level) {
        sum += side * side;
        side = side / 2 + 3;
    }
    return sum + std::max(side * side, 2 * kMaxPixels);
}

// Fills the pixels of `part` of the finest field: memory begins with them. whole: the top level is
// not filled yet.
__device__ void fill_part(const DisparityPyramid& pyramid, const Part& part, bool whole,
                          int16_t* memory) {
    const int top = top_level(pyramid);
    Part parts[kTiledLevels + 1];
    int first[kTiledLevels + 1];
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
        parts[level].each([&](int x, int y, int i) { to[i] = from[y * size.width + x]; });
    }
    __syncthreads();
#pragma unroll
    for (int level = kTiledLevels; level >= 0; --level) {
        if (level > top) continue;
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
    RefineTile<kRadius> tile;
    float2 means[kMeans];
    int16_t fields[max_pixels<kRadius>()];
};

template <int kRadius>
__global__ void __launch_bounds__(kThreads, 3) make_dense(DenseStep step, bool whole) {
    Block<kRadius>& block = *dynamic_shared<Block<kRadius>>();
    auto& tile = block.tile;
    auto& means = block.means;
    auto& fields = block.fields;
    constexpr int kSide = RefineTile<kRadius>::kSide, kMargin = kHalfSmoothRadius;
    const StereoShape& shape = step.shape;
    const int width = shape.half_width, height = shape.half_height,
              thread = static_cast<int>(threadIdx.x);
    // Of what is refined; what the block owns begins kMargin further.
    const int left = static_cast<int>(blockIdx.x) * kOwned - kMargin,
              top = static_cast<int>(blockIdx.y) * kOwned - kMargin;
    const Part part{max(0, left - kRadius), max(0, top - kRadius),
                    min(width, left + kRefineTile + kRadius),
                    min(height, top + kRefineTile + kRadius)};
    make_means(means);
    fill_part(step.pyramid, part, whole, fields);
    const auto dense = [&](int x, int y) {
        return int{fields[(y - part.y0) * part.width() + x - part.x0]};
    };

    // The windows' pixels, and the extremes of the field along rows.
#pragma unroll 5
    for (int i = thread; i < kSide * kSide; i += kThreads) {
        const int column = i % kSide, row = i / kSide, x = left - kRadius + column,
                  y = top - kRadius + row;
        // Outside the image some pixel is read that does not matter.
        const int at_x = clamped(x, part.x0, part.x1 - 1), at_y = clamped(y, part.y0, part.y1 - 1),
                  line = at_y * gray_stride(shape.half_stride);
        const uint2 cell =
            refine_cell(step.left[line + at_x], step.right + line, dense(at_x, at_y), at_x);
        const bool inside = x == at_x && y == at_y;
        tile.cells[row][column] = make_uint2(inside ? cell.x : 0, inside ? cell.y : 0);
    }
    int* const minimum = &tile.columns[0][0][0];
    int* const maximum = &tile.columns[1][0][0];
    constexpr int kRows = kOwned + 2 * kEdgeRadius;
    static_assert(kRows * kOwned <= kRefineTile * RefineTile<kRadius>::kStride &&
                  kEdgeRadius <= kMargin + kRadius);
    for (int i = thread; i < kRows * kOwned; i += kThreads) {
        const int x = left + kMargin + i % kOwned, y = top + kMargin - kEdgeRadius + i / kOwned;
        if (x >= width || y < 0 || y >= height) continue;
        int lowest = dense(x, y), highest = lowest;
#pragma unroll
        for (int u = -kEdgeRadius; u <= kEdgeRadius; ++u) {
            const int disparity = dense(clamped(x + u, 0, width - 1), y);
            lowest = min(lowest, disparity);
            highest = max(highest, disparity);
        }
        minimum[i] = lowest;
        maximum[i] = highest;
    }
    __syncthreads();
    for (int i = thread; i < kOwned * kOwned; i += kThreads) {
        const int x = left + kMargin + i % kOwned, y = top + kMargin + i / kOwned;
        if (x >= width || y >= height) continue;
        const int here = dense(x, y);
        int lowest = here, highest = here;
#pragma unroll
        for (int v = -kEdgeRadius; v <= kEdgeRadius; ++v) {
            const int at = i + (clamped(y + v, 0, height - 1) - y + kEdgeRadius) * kOwned;
            lowest = min(lowest, minimum[at]);
            highest = max(highest, maximum[at]);
        }
        const bool open =
            highest - lowest > shape.edge || step.supported[y * width + x] == kNoDisparity;
        step.standing[y * shape.half_stride + x] = here - lowest > shape.edge ? kDoubtful
                                                   : open                     ? kOpen
                                                                              : kSettled;
        if (step.dense != nullptr) step.dense[y * width + x] = static_cast<int16_t>(here);
    }
    __syncthreads();
    refine_tile<kThreads, kRun>(tile, left, top, width, height, [](uint32_t) { return 0; });

    const auto refined = [&](int column, int row) -> int& { return tile.columns[1][row][column]; };
    const auto smoothed = [&](int column, int row) -> int& { return tile.columns[2][row][column]; };
    for (int i = thread; i < kRefineTile * kRefineTile; i += kThreads) {
        const int column = i % kRefineTile, row = i / kRefineTile, x = left + column, y = top + row;
        float disparity = kMissing;
        if (x >= 0 && y >= 0 && x < width && y < height && dense(x, y) != kNoDisparity)
            disparity =
                static_cast<float>(moved(dense(x, y), unpack(tile.result(column, row)).move));
        refined(column, row) = __float_as_int(disparity);
    }
    __syncthreads();
    float line[kLine], run[kRun];
    for (int i = thread; i < kRefineTile * (kOwned / kRun); i += kThreads) {
        const int row = i % kRefineTile, column = i / kRefineTile * kRun;
#pragma unroll
        for (int u = 0; u < kLine; ++u) line[u] = __int_as_float(refined(column + u, row));
        smooth_along<kHalfSmoothRadius, kRun>(line, kHalfSmoothRange, means, run);
#pragma unroll
        for (int u = 0; u < kRun; ++u) smoothed(column + u, row) = __float_as_int(run[u]);
    }
    __syncthreads();
    for (int i = thread; i < kOwned * (kOwned / kRun); i += kThreads) {
        const int column = i % kOwned, row = i / kOwned * kRun, x = left + kMargin + column;
#pragma unroll
        for (int v = 0; v < kLine; ++v) line[v] = __int_as_float(smoothed(column, row + v));
        smooth_along<kHalfSmoothRadius, kRun>(line, kHalfSmoothRange, means, run);
#pragma unroll
        for (int v = 0; v < kRun; ++v) {
            const int y = top + kMargin + row + v;
            if (x < width && y < height)
                step.result[y * width + x] = static_cast<int16_t>(from_smooth(run[v]));
        }
    }
}

}  // namespace

void record_dense(Recorder& recorder, const DenseStep& step) {
    const int top = top_level(step.pyramid);
    const bool whole =
        step.pyramid.levels[top].width * step.pyramid.levels[top].height <= kMaxPixels;
    if (!whole) recorder.launch(fill_top, {dim3(1), dim3(kFillThreads)}, step.pyramid, top);
    const auto columns = static_cast<uint32_t>(step.shape.half_width),
               rows = static_cast<uint32_t>(step.shape.half_height);
    const dim3 blocks(cover(columns, kOwned), cover(rows, kOwned));
    with_radius(step.shape.radius, [&]<int kRadius>(std::integral_constant<int, kRadius>) {
        recorder.launch(make_dense<kRadius>, {blocks, dim3(kThreads), sizeof(Block<kRadius>)}, step,
                        whole);
    });
}

}  // namespace defrec::cuda
