// Stage stereo, the end of section 10 and section 11: speckles go and small holes are filled, in
// one pass over tiles.
#include "backends/cuda/stereo_steps.hpp"
#include "backends/cuda/stereo_windows.cuh"

namespace defrec::cuda {
namespace {

constexpr int kWidth = 64, kHeight = 32, kRun = 8;
constexpr int kThreads = 576;  // for the most runs of a pass, 10 x 56
constexpr int kSpeckleRadius = 4, kMaxFillRadius = 8;
constexpr int kReachWidth = kWidth + 2 * (kSpeckleRadius + kMaxFillRadius),
              kReachHeight = kHeight + 2 * (kSpeckleRadius + kMaxFillRadius);
constexpr int kStride = kReachWidth + 4;  // rows eight apart in four words each do not share banks
static_assert(kStride % 8 == 4);
constexpr int kOne = 1 << 16;  // a cell counts its disparity above its difference to the
                               // hypothesis, which is at most 16 either way

struct Tile {
    alignas(16) int cells[kReachHeight][kStride];
    alignas(16) int rows[kReachHeight][kStride];
};

// Sums over 2 radius + 1 cells along a line, of kRun of them from `line` on, `step` apart.
template <class Give>
__device__ __forceinline__ void sum_line(const int* line, int step, int radius, Give&& give) {
    int sum = 0;
    for (int i = 0; i < 2 * radius; ++i) sum += line[i * step];
#pragma unroll
    for (int i = 0; i < kRun; ++i) {
        sum += line[(i + 2 * radius) * step];
        give(i, sum);
        sum -= line[i * step];
    }
}

__global__ void __launch_bounds__(kThreads) finish(FinishStep step) {
    __shared__ Tile tile;
    const StereoShape& shape = step.shape;
    const int radius = shape.fill_radius, margin = radius + kSpeckleRadius,
              thread = static_cast<int>(threadIdx.x);
    const int left = static_cast<int>(blockIdx.x) * kWidth,
              top = static_cast<int>(blockIdx.y) * kHeight;
    // Sizes of what the speckles are classified in, which is `radius` larger all round than the
    // tile; rounded up to runs.
    const int width = kWidth + 2 * radius, height = kHeight + 2 * radius;
    const int width_runs = (width + kRun - 1) / kRun, height_runs = (height + kRun - 1) / kRun;

    const int reach_width = kRun * width_runs + 2 * kSpeckleRadius,
              reach_height = kRun * height_runs + 2 * kSpeckleRadius;
    constexpr int kLanes = static_cast<int>(kWarp);
#pragma unroll 4
    for (int row = thread / kLanes; row < reach_height; row += kThreads / kLanes) {
#pragma unroll
        for (int lanes = 0; lanes < kReachWidth; lanes += kLanes) {
            const int column = lanes + thread % kLanes, x = left - margin + column,
                      y = top - margin + row;
            const bool inside =
                column < reach_width && x >= 0 && y >= 0 && x < shape.width && y < shape.height;
            const int evidence =
                inside ? __ldg(step.evidence + y * shape.full_stride + x) : kNoDisparity;
            if (column < reach_width) tile.cells[row][column] = evidence != kNoDisparity;
        }
    }
    __syncthreads();
    int line[kRun + 2 * kSpeckleRadius], counts[kRun];
    for (int i = thread; i < reach_height * width_runs; i += kThreads) {
        const int row = i % reach_height, column = i / reach_height * kRun;
#pragma unroll
        for (int u = 0; u < kRun + 2 * kSpeckleRadius; ++u) line[u] = tile.cells[row][column + u];
        sum_along<kSpeckleRadius, kRun>(line, counts);
#pragma unroll
        for (int u = 0; u < kRun; ++u) tile.rows[row][column + u] = counts[u];
    }
    __syncthreads();
    for (int i = thread; i < width * height_runs; i += kThreads) {
        const int column = i % width, row = i / width * kRun, x = left - radius + column;
#pragma unroll
        for (int v = 0; v < kRun + 2 * kSpeckleRadius; ++v) line[v] = tile.rows[row + v][column];
        sum_along<kSpeckleRadius, kRun>(line, counts);
#pragma unroll
        for (int v = 0; v < kRun; ++v) {
            const int y = top - radius + row + v;
            const bool inside = x >= 0 && y >= 0 && x < shape.width && y < shape.height;
            const int at = inside ? y * shape.full_stride + x : 0,
                      found = __ldg(step.evidence + at), hypothesis = __ldg(step.hypothesis + at);
            const int evidence =
                inside && 25 * counts[v] >= 81 * shape.support ? found : kNoDisparity;
            tile.cells[row + v][column] =
                evidence == kNoDisparity ? 0 : kOne + evidence - hypothesis;
            if (step.given_evidence != nullptr && inside && x >= left && x < left + kWidth &&
                y >= top && y < top + kHeight)
                step.given_evidence[y * shape.width + x] = static_cast<int16_t>(evidence);
        }
    }
    __syncthreads();
    for (int i = thread; i < height * (kWidth / kRun); i += kThreads) {
        const int row = i % height, column = i / height * kRun;
        sum_line(&tile.cells[row][column], 1, radius,
                 [&](int u, int sum) { tile.rows[row][column + u] = sum; });
    }
    __syncthreads();
    const int enough = (2 * radius + 1) * (2 * radius + 1);
    for (int i = thread; i < kWidth * (kHeight / kRun); i += kThreads) {
        const int column = i % kWidth, row = i / kWidth * kRun, x = left + column;
        if (x >= shape.width) continue;
        sum_line(&tile.rows[row][column], kStride, radius, [&](int v, int sum) {
            const int y = top + row + v;
            if (y >= shape.height) return;
            const int at = y * shape.full_stride + x, hypothesis = __ldg(step.hypothesis + at),
                      cell = tile.cells[row + radius + v][column + radius];
            const int m = (sum + kOne / 2) >> 16, differences = sum - m * kOne;
            const bool known = cell != 0, filled = !known && 2 * m >= enough;
            int disparity = known ? hypothesis + cell - kOne : kNoDisparity;
            if (filled) {
                const int dividend = 2 * differences + m, quotient = dividend / (2 * m);
                disparity = max(0, hypothesis + quotient - (dividend - 2 * m * quotient < 0));
            }
            if (step.given_confidence != nullptr)
                step.given_confidence[int64_t{y} * shape.stride + x] =
                    known    ? __ldg(step.confidence + at)
                    : filled ? kFilledConfidence
                             : 0;
            if (step.given_filled != nullptr)
                step.given_filled[y * shape.width + x] = static_cast<int16_t>(disparity);
            step.filled[at] = static_cast<int16_t>(disparity);
        });
    }
}

}  // namespace

void record_finish(Recorder& recorder, const FinishStep& step) {
    const auto columns = static_cast<uint32_t>(step.shape.width),
               rows = static_cast<uint32_t>(step.shape.height);
    recorder.launch(finish, {dim3(cover(columns, kWidth), cover(rows, kHeight)), dim3(kThreads)},
                    step);
}

}  // namespace defrec::cuda
