// Stage stereo, sections 4 and 5, and of 6 the smoothing and the coarser fields up to level
// kTiledLevels: a block does all of them for a tile, with what they need round it.
#include "backends/cuda/stereo_smooth.cuh"
#include "backends/cuda/stereo_steps.hpp"

namespace defrec::cuda {
namespace {

constexpr int kWidth = 32, kHeight = 16;
constexpr int kThreads = 384;  // for the 36 x 20 supported pixels in two rounds
constexpr int kSmoothed = kHalfSmoothRadius, kReach = 4;  // of section 5
constexpr int kRun = 4, kLine = kRun + 2 * kSmoothed;
constexpr int kSupportedWidth = kWidth + 2 * kSmoothed, kSupportedHeight = kHeight + 2 * kSmoothed;
constexpr int kCheckedWidth = kSupportedWidth + 2 * kReach,
              kCheckedHeight = kSupportedHeight + 2 * kReach;
static_assert(kWidth >> kTiledLevels >= 1 && kHeight >> kTiledLevels >= 1);

// Disparities as smoothing has them.
struct Tile {
    float2 means[kMeans];
    float checked[kCheckedHeight][kCheckedWidth + 1];
    float supported[kSupportedHeight][kSupportedWidth + 1];
    float rows[kSupportedHeight][kWidth + 1];
    int fields[2][kHeight][kWidth + 1];  // a level of the pyramid and the next
};

__device__ __forceinline__ float check(const AgreeStep& step, int x, int y) {
    const StereoShape& shape = step.shape;
    const int radius = shape.radius;
    if (x < radius + shape.first || x >= shape.half_width - radius || y < radius ||
        y >= shape.half_height - radius)
        return kMissing;
    // Without a candidate some pixel is read that does not matter, so that no read waits for a
    // comparison.
    const int row = y * shape.half_stride, candidate = __ldg(step.candidates + row + x),
              left_usable = __ldg(step.left_mask + row + x);
    const int index = max(candidate - 1, 0), d = shape.first + index;
    const int right_usable = __ldg(step.right_mask + row + x - d),
              back = __ldg(step.right_keys + y * shape.half_width + x - d) & 255;
    const bool good = candidate != 0 && left_usable != 0 && right_usable != 0 &&
                      abs(back - index) <= shape.left_right;
    return good ? static_cast<float>(16 * d) : kMissing;
}

__device__ float supported(const Tile& tile, int column, int row, int support) {
    const float disparity = tile.checked[row + kReach][column + kReach];
    if (disparity == kMissing) return kMissing;
    int agreeing = 0;
#pragma unroll
    for (int v = 0; v <= 2 * kReach; v += 2)
#pragma unroll
        for (int u = 0; u <= 2 * kReach; u += 2)
            agreeing += fabsf(tile.checked[row + v][column + u] - disparity) <=
                        static_cast<float>(kSupportRange);
    return agreeing >= support ? disparity : kMissing;
}

__device__ void make_coarser(Tile& tile, const DisparityPyramid& pyramid, int left, int top) {
    const int last = top_level(pyramid);
    for (int level = 1; level <= last; ++level) {
        const auto& fine = tile.fields[(level - 1) % 2];
        auto& coarse = tile.fields[level % 2];
        const DisparityPyramid::Level& to = pyramid.levels[level];
        const int width = kWidth >> level, height = kHeight >> level;
        for (int i = static_cast<int>(threadIdx.x); i < width * height; i += kThreads) {
            const int column = i % width, row = i / width, x = (left >> level) + column,
                      y = (top >> level) + row;
            int sum = 0, n = 0;
#pragma unroll
            for (int k = 0; k < 4; ++k) {
                const int disparity = fine[2 * row + k / 2][2 * column + k % 2];
                if (disparity == kNoDisparity) continue;
                sum += disparity;
                ++n;
            }
            const int mean =
                n == 0 ? kNoDisparity : (2 * sum + n) / (2 * n);  // disparities are not negative
            coarse[row][column] = mean;
            if (x < to.width && y < to.height)
                pyramid.data[to.offset + y * to.width + x] = static_cast<int16_t>(mean);
        }
        __syncthreads();
    }
}

__global__ void __launch_bounds__(kThreads) agree(AgreeStep step) {
    __shared__ Tile tile;
    const StereoShape& shape = step.shape;
    const int left = static_cast<int>(blockIdx.x) * kWidth,
              top = static_cast<int>(blockIdx.y) * kHeight;
    const int thread = static_cast<int>(threadIdx.x);
    const auto owned = [&](int column, int row) {
        return column >= 0 && column < kWidth && row >= 0 && row < kHeight &&
               left + column < shape.half_width && top + row < shape.half_height;
    };
    make_means(tile.means);
#pragma unroll 4
    for (int i = thread; i < kCheckedWidth * kCheckedHeight; i += kThreads) {
        const int u = i % kCheckedWidth, v = i / kCheckedWidth, column = u - kSmoothed - kReach,
                  row = v - kSmoothed - kReach;
        const float disparity = check(step, left + column, top + row);
        tile.checked[v][u] = disparity;
        if (step.checked != nullptr && owned(column, row))
            step.checked[(top + row) * shape.half_width + left + column] =
                static_cast<int16_t>(from_smooth(disparity));
    }
    __syncthreads();
    for (int i = thread; i < kSupportedWidth * kSupportedHeight; i += kThreads) {
        const int u = i % kSupportedWidth, v = i / kSupportedWidth, column = u - kSmoothed,
                  row = v - kSmoothed;
        const float disparity = supported(tile, u, v, shape.support);
        tile.supported[v][u] = disparity;
        if (owned(column, row))
            step.supported[(top + row) * shape.half_width + left + column] =
                static_cast<int16_t>(from_smooth(disparity));
    }
    __syncthreads();
    float line[kLine], smoothed[kRun];
    for (int i = thread; i < kSupportedHeight * (kWidth / kRun); i += kThreads) {
        const int row = i % kSupportedHeight, column = i / kSupportedHeight * kRun;
#pragma unroll
        for (int u = 0; u < kLine; ++u) line[u] = tile.supported[row][column + u];
        smooth_along<kSmoothed, kRun>(line, kSearchSmoothRange, tile.means, smoothed);
#pragma unroll
        for (int u = 0; u < kRun; ++u) tile.rows[row][column + u] = smoothed[u];
    }
    __syncthreads();
    for (int i = thread; i < kWidth * (kHeight / kRun); i += kThreads) {
        const int column = i % kWidth, row = i / kWidth * kRun;
#pragma unroll
        for (int v = 0; v < kLine; ++v) line[v] = tile.rows[row + v][column];
        smooth_along<kSmoothed, kRun>(line, kSearchSmoothRange, tile.means, smoothed);
#pragma unroll
        for (int v = 0; v < kRun; ++v) {
            const int disparity = from_smooth(smoothed[v]);
            tile.fields[0][row + v][column] = disparity;
            if (owned(column, row + v))
                step.pyramid.data[(top + row + v) * shape.half_width + left + column] =
                    static_cast<int16_t>(disparity);
        }
    }
    __syncthreads();
    make_coarser(tile, step.pyramid, left, top);
}

}  // namespace

void record_agree(Recorder& recorder, const AgreeStep& step) {
    const auto columns = static_cast<uint32_t>(step.shape.half_width),
               rows = static_cast<uint32_t>(step.shape.half_height);
    recorder.launch(agree, {dim3(cover(columns, kWidth), cover(rows, kHeight)), dim3(kThreads)},
                    step);
}

}  // namespace defrec::cuda
