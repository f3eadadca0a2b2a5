// Stage stereo, section 12: several passes at once, on tiles with as much round them as the passes
// reach.
#include "backends/cuda/stereo_smooth.cuh"
#include "backends/cuda/stereo_steps.hpp"

namespace defrec::cuda {
namespace {

constexpr int kWidth = 64, kHeight = 32, kRun = 8;
constexpr int kThreads = 640;  // for the most runs of a pass, 11 x 56
constexpr int kMaxPasses = 4;  // of one kernel
constexpr int kMaxRadius = 3, kMaxWidth = kWidth + 2 * kMaxPasses * kMaxRadius;
constexpr int kReachPerRun = 4;  // that a run is read with on either side: whole vectors of four

// A tile with `margin` pixels round it. Rows are read in vectors of four from kReachPerRun before a
// run's first pixel, and are so long that those eight apart do not share banks; after the last
// there is what the last run of a column reads beyond it.
struct Layout {
    int margin;
    __host__ __device__ int width() const { return kWidth + 2 * margin; }
    __host__ __device__ int height() const { return kHeight + 2 * margin; }
    __host__ __device__ int stride() const {
        return (width() + kRun - 1) / kRun * kRun + 2 * kReachPerRun + 4;
    }
    __host__ __device__ int cells() const { return stride() * (height() + kRun - 1); }
};

template <int kRadius>
__global__ void __launch_bounds__(kThreads)
    smooth(SmoothStep step, const int16_t* from, int16_t* to, int to_stride, int passes) {
    constexpr int kLine = kRun + 2 * kRadius, kSkip = kReachPerRun - kRadius;
    __shared__ float2 means[kMeans];
    const StereoShape& shape = step.shape;
    const Layout layout{passes * kRadius};
    const int left = static_cast<int>(blockIdx.x) * kWidth - layout.margin,
              top = static_cast<int>(blockIdx.y) * kHeight - layout.margin;
    const int width = layout.width(), height = layout.height(), stride = layout.stride(),
              thread = static_cast<int>(threadIdx.x);
    float* const cells = dynamic_shared<float>();
    float* const rows = cells + layout.cells();
    const auto range = static_cast<float>(shape.smooth_range);

    make_means(means);
#pragma unroll 4
    for (int row = thread / static_cast<int>(kWarp); row < height;
         row += kThreads / static_cast<int>(kWarp)) {
#pragma unroll
        for (int lanes = 0; lanes < kMaxWidth; lanes += static_cast<int>(kWarp)) {
            const int column = lanes + thread % static_cast<int>(kWarp), x = left + column,
                      y = top + row;
            const bool inside = x >= 0 && y >= 0 && x < shape.width && y < shape.height;
            const int disparity =
                inside && column < width ? from[y * shape.full_stride + x] : kNoDisparity;
            if (column < width) cells[row * stride + kReachPerRun + column] = to_smooth(disparity);
        }
    }
    __syncthreads();
    alignas(16) float line[kRun + 2 * kReachPerRun];
    float used[kLine], smoothed[kRun];
    for (int pass = 0; pass < passes; ++pass) {
        // What the pass reads begins at `first`; it leaves kRadius less on every side.
        const int first = pass * kRadius, read_rows = height - 2 * first;
        const int first_run = (first + kRadius) / kRun,
                  runs = (width - first - kRadius + kRun - 1) / kRun - first_run;
        for (int i = thread; i < read_rows * runs; i += kThreads) {
            const int at = (first + i % read_rows) * stride + (first_run + i / read_rows) * kRun;
#pragma unroll
            for (int u = 0; u < kRun + 2 * kReachPerRun; u += 4)
                *reinterpret_cast<float4*>(line + u) =
                    *reinterpret_cast<const float4*>(cells + at + u);
#pragma unroll
            for (int u = 0; u < kLine; ++u) used[u] = line[kSkip + u];
            smooth_along<kRadius, kRun>(used, range, means, smoothed);
#pragma unroll
            for (int u = 0; u < kRun; u += 4)
                *reinterpret_cast<float4*>(rows + at + kReachPerRun + u) =
                    make_float4(smoothed[u], smoothed[u + 1], smoothed[u + 2], smoothed[u + 3]);
        }
        __syncthreads();
        const int left_width = width - 2 * first - 2 * kRadius,
                  left_height = read_rows - 2 * kRadius,
                  column_runs = (left_height + kRun - 1) / kRun;
        for (int i = thread; i < left_width * column_runs; i += kThreads) {
            const int column = first + kRadius + i % left_width,
                      row = first + i / left_width * kRun;
            const int at = row * stride + kReachPerRun + column;
#pragma unroll
            for (int v = 0; v < kLine; ++v) used[v] = rows[at + v * stride];
            smooth_along<kRadius, kRun>(used, range, means, smoothed);
#pragma unroll
            for (int v = 0; v < kRun; ++v) cells[at + (kRadius + v) * stride] = smoothed[v];
        }
        __syncthreads();
    }
    for (int i = thread; i < kWidth * kHeight; i += kThreads) {
        const int column = layout.margin + i % kWidth, row = layout.margin + i / kWidth,
                  x = left + column, y = top + row;
        if (x < shape.width && y < shape.height)
            to[int64_t{y} * to_stride + x] =
                static_cast<int16_t>(from_smooth(cells[row * stride + kReachPerRun + column]));
    }
}

auto kernel_of(int radius) {
    switch (radius) {
        case 2:
            return smooth<2>;
        case 3:
            return smooth<3>;
        default:
            return smooth<1>;
    }
}

}  // namespace

void record_smooth(Recorder& recorder, const SmoothStep& step) {
    const StereoShape& shape = step.shape;
    const auto columns = static_cast<uint32_t>(shape.width),
               rows = static_cast<uint32_t>(shape.height);
    int left =
        shape.smooth_radius == 0 ? 0 : shape.smooth_passes;  // a pass of radius 0 changes nothing
    int16_t *from = step.field, *other = step.other;
    do {
        const int passes = std::min(left, kMaxPasses);
        left -= passes;
        int16_t* const to = left == 0 ? step.result : other;
        const Layout layout{passes * std::max(shape.smooth_radius, 1)};
        const Grid grid{dim3(cover(columns, kWidth), cover(rows, kHeight)), dim3(kThreads),
                        2 * sizeof(float) * static_cast<size_t>(layout.cells())};
        recorder.launch(kernel_of(shape.smooth_radius), grid, step, from, to,
                        left == 0 ? shape.stride : shape.full_stride, passes);
        std::swap(from, other);
    } while (left > 0);
}

}  // namespace defrec::cuda
