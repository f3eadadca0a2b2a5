// Stage stereo, sections 4 and 5, and of 6 the smoothing and the coarser fields up to level
// kTiledLevels: a block does all of them for a tile of samples, with what they need round it.
#include "backends/cuda/stereo_smooth.cuh"
#include "backends/cuda/stereo_steps.hpp"
#include "backends/cuda/stereo_windows.cuh"

namespace defrec::cuda {
namespace {

constexpr int kWidth = 16, kHeight = 16, kThreads = 352;  // for the 18 x 18 supported samples
constexpr int kSmoothed = kHalfSmoothRadius, kReach = kSupportRadius;
constexpr int kSupportedWidth = kWidth + 2 * kSmoothed, kSupportedHeight = kHeight + 2 * kSmoothed;
constexpr int kCheckedWidth = kSupportedWidth + 2 * kReach,
              kCheckedHeight = kSupportedHeight + 2 * kReach;
static_assert(kSmoothed == 1);
static_assert(kWidth >> kTiledLevels >= 1 && kHeight >> kTiledLevels >= 1);

// Disparities as smoothing has them.
struct Tile {
    float checked[kCheckedHeight][kCheckedWidth + 1];
    float supported[kSupportedHeight][kSupportedWidth + 1];
    int fields[2][kHeight][kWidth + 1];  // a level of the pyramid and the next
};

// The samples that may have a candidate.
struct Searched {
    __device__ explicit Searched(const StereoShape& shape)
        : left((shape.radius + shape.first + 1) / 2),
          top((shape.radius + 1) / 2),
          right((shape.half_width - shape.radius - 1) >> 1),
          bottom((shape.half_height - shape.radius - 1) >> 1) {}
    __device__ bool empty() const { return left > right || top > bottom; }
    int left, top, right, bottom;  // the last two among them
};

// Checks the sample (i, j). searched: not empty.
__device__ __forceinline__ float check(const AgreeStep& step, const Searched& searched, int i,
                                       int j) {
    const StereoShape& shape = step.shape;
    // Without a candidate some pixel is read that does not matter, so that no read waits for a
    // comparison.
    const int at_i = clamped(i, searched.left, searched.right),
              at_j = clamped(j, searched.top, searched.bottom);
    const int x = 2 * at_i, row = at_j * shape.half_stride,
              candidate = __ldg(step.candidates + at_j * shape.half_samples_x + at_i),
              left_usable = __ldg(step.left_mask + row + x);
    const int index = max(candidate - 1, 0), d = shape.first + index;
    const int right_usable = __ldg(step.right_mask + row + x - d),
              back = __ldg(step.right_keys + at_j * shape.half_width + x - d) & 255;
    const bool good = (i == at_i) & (j == at_j) & (candidate != 0) & (left_usable != 0) &
                      (right_usable != 0) & (abs(back - index) <= shape.left_right);
    return good ? static_cast<float>(16 * d) : kMissing;
}

__device__ float supported(const Tile& tile, int column, int row, int support) {
    const float disparity = tile.checked[row + kReach][column + kReach];
    if (disparity == kMissing) return kMissing;
    int agreeing = 0;
#pragma unroll
    for (int v = 0; v <= 2 * kReach; ++v)
#pragma unroll
        for (int u = 0; u <= 2 * kReach; ++u)
            agreeing += fabsf(tile.checked[row + v][column + u] - disparity) <=
                        static_cast<float>(kSupportRange);
    return agreeing >= support ? disparity : kMissing;
}

// By one warp.
__device__ void make_coarser(Tile& tile, const DisparityPyramid& pyramid, int left, int top) {
    const int last = top_level(pyramid);
    for (int level = 1; level <= last; ++level) {
        const auto& fine = tile.fields[(level - 1) % 2];
        auto& coarse = tile.fields[level % 2];
        const DisparityPyramid::Level& to = pyramid.levels[level];
        const int width = kWidth >> level, height = kHeight >> level;
        for (int i = static_cast<int>(threadIdx.x); i < width * height;
             i += static_cast<int>(kWarp)) {
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
        __syncwarp();
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
               left + column < shape.half_samples_x && top + row < shape.half_samples_y;
    };
    const Searched searched(shape);
    constexpr int kChecked = kCheckedWidth * kCheckedHeight,
                  kRounds = (kChecked + kThreads - 1) / kThreads;
    float checked[kRounds];
#pragma unroll
    for (int k = 0; k < kRounds; ++k) {
        const int i = thread + k * kThreads, column = i % kCheckedWidth - kSmoothed - kReach,
                  row = i / kCheckedWidth - kSmoothed - kReach;
        checked[k] = searched.empty() ? kMissing : check(step, searched, left + column, top + row);
    }
#pragma unroll
    for (int k = 0; k < kRounds; ++k) {
        const int i = thread + k * kThreads, u = i % kCheckedWidth, v = i / kCheckedWidth,
                  column = u - kSmoothed - kReach, row = v - kSmoothed - kReach;
        if (i >= kChecked) break;
        const float disparity = checked[k];
        tile.checked[v][u] = disparity;
        if (step.checked != nullptr && owned(column, row))
            step.checked[(top + row) * shape.half_samples_x + left + column] =
                static_cast<int16_t>(from_smooth(disparity));
    }
    __syncthreads();
    for (int i = thread; i < kSupportedWidth * kSupportedHeight; i += kThreads) {
        const int u = i % kSupportedWidth, v = i / kSupportedWidth, column = u - kSmoothed,
                  row = v - kSmoothed;
        const float disparity = supported(tile, u, v, shape.support);
        tile.supported[v][u] = disparity;
        if (owned(column, row))
            step.supported[(top + row) * shape.half_samples_x + left + column] =
                static_cast<int16_t>(from_smooth(disparity));
    }
    __syncthreads();
    for (int i = thread; i < kWidth * kHeight; i += kThreads) {
        const int column = i % kWidth, row = i / kWidth;
        float cells[3][3];
#pragma unroll
        for (int v = 0; v < 3; ++v)
#pragma unroll
            for (int u = 0; u < 3; ++u) cells[v][u] = tile.supported[row + v][column + u];
        const int disparity = from_smooth(smooth_centre(cells, kSearchSmoothRange));
        tile.fields[0][row][column] = disparity;
        if (owned(column, row))
            step.pyramid.data[(top + row) * shape.half_samples_x + left + column] =
                static_cast<int16_t>(disparity);
    }
    __syncthreads();
    if (thread < static_cast<int>(kWarp)) make_coarser(tile, step.pyramid, left, top);
}

}  // namespace

void record_agree(Recorder& recorder, const AgreeStep& step) {
    const auto columns = static_cast<uint32_t>(step.shape.half_samples_x),
               rows = static_cast<uint32_t>(step.shape.half_samples_y);
    recorder.launch(agree, {dim3(cover(columns, kWidth), cover(rows, kHeight)), dim3(kThreads)},
                    step);
}

}  // namespace defrec::cuda
