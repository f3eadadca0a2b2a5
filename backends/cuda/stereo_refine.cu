// Stage stereo, sections 8 to 10 at full resolution: a block makes the hypothesis of its tile and
// the windows round it, refines and classifies.
#include "backends/cuda/stereo_refine.cuh"
#include "backends/cuda/stereo_steps.hpp"

namespace defrec::cuda {
namespace {

constexpr int kThreads = 160;  // for the runs of columns of one image at a radius of 4, 40 x 4

// Section 9. x, y may lie outside the image where the result is not used.
template <int kSide>
__device__ int upsampled(const int16_t (&half)[kSide][kSide + 2], int first_u, int first_v, int x,
                         int y) {
    const int u = (x >> 1) - first_u, v = (y >> 1) - first_v, u2 = (x & 1) == 0 ? u - 1 : u + 1,
              v2 = (y & 1) == 0 ? v - 1 : v + 1;
    const int a = half[v][u], b = half[v][u2], c = half[v2][u], d = half[v2][u2];
    if (a == kNoDisparity) return kNoDisparity;
    const bool one_surface =
        max(max(a, b), max(c, d)) - min(min(a, b), min(c, d)) <= kUpsampleRange;
    return one_surface ? (9 * a + 3 * b + 3 * c + d + 4) >> 3 : 2 * a;
}

template <int kRadius>
struct Block {
    static constexpr int kSide = RefineTile<kRadius>::kSide, kHalfSide = kSide / 2 + 3;
    RefineTile<kRadius> tile;
    int16_t half[kHalfSide][kHalfSide + 2];
    int16_t hypotheses[kRefineTile][kRefineTile + 2];
};

template <int kRadius>
__global__ void __launch_bounds__(kThreads, 4) refine(RefineStep step) {
    constexpr int kSide = Block<kRadius>::kSide, kHalfSide = Block<kRadius>::kHalfSide;
    Block<kRadius>& block = *dynamic_shared<Block<kRadius>>();
    auto& [tile, half, hypotheses] = block;
    const StereoShape& shape = step.shape;
    const int left = static_cast<int>(blockIdx.x) * kRefineTile,
              top = static_cast<int>(blockIdx.y) * kRefineTile;
    const int thread = static_cast<int>(threadIdx.x);

    const int first_u = ((left - kRadius) >> 1) - 1, first_v = ((top - kRadius) >> 1) - 1;
    for (int i = thread; i < kHalfSide * kHalfSide; i += kThreads) {
        const int u = i % kHalfSide, v = i / kHalfSide;
        const int at_u = clamped(first_u + u, 0, shape.half_width - 1),
                  at_v = clamped(first_v + v, 0, shape.half_height - 1);
        half[v][u] = __ldg(step.half + at_v * shape.half_width + at_u);
    }
    __syncthreads();
#pragma unroll 5
    for (int i = thread; i < kSide * kSide; i += kThreads) {
        const int column = i % kSide - kRadius, row = i / kSide - kRadius, x = left + column,
                  y = top + row;
        const int hypothesis = upsampled(half, first_u, first_v, x, y);
        // Outside the image some pixel is read that does not matter.
        const int at_x = clamped(x, 0, shape.width - 1),
                  line = clamped(y, 0, shape.height - 1) * gray_stride(shape.full_stride);
        const uint2 cell = refine_cell(step.left[line + at_x], step.right + line, hypothesis, at_x);
        const bool inside = x == at_x && y >= 0 && y < shape.height;
        tile.cells[row + kRadius][column + kRadius] =
            make_uint2(inside ? cell.x : 0, inside ? cell.y : 0);
        if (column >= 0 && row >= 0 && column < kRefineTile && row < kRefineTile)
            hypotheses[row][column] = static_cast<int16_t>(hypothesis);
    }
    __syncthreads();
    // The least v with 256 v >= texture^2 n^2.
    const auto min_variance = [&](uint32_t n) {
        const uint64_t deviation = uint64_t{static_cast<uint32_t>(shape.texture)} * n;
        return static_cast<int>((deviation * deviation + 255) >> 8);
    };
    refine_tile<kThreads, kRefineRun>(tile, left, top, shape.width, shape.height, min_variance);

#pragma unroll 4
    for (int i = thread; i < kRefineTile * kRefineTile; i += kThreads) {
        const int column = i % kRefineTile, row = i / kRefineTile, x = left + column, y = top + row;
        if (x >= shape.width || y >= shape.height) continue;
        const Refined refined = unpack(tile.result(column, row));
        const int hypothesis = hypotheses[row][column];
        const bool any = hypothesis != kNoDisparity;
        const int refined_disparity = any ? moved(hypothesis, refined.move) : kNoDisparity,
                  score = any ? refined.score : 0;
        const int u = min(x >> 1, shape.half_width - 1), v = min(y >> 1, shape.half_height - 1);
        const int64_t line = int64_t{y} * shape.stride;
        const int q = 16 * x - refined_disparity;
        // All reads before any decision: then they do not wait for each other.
        const int stands = __ldg(step.standing + v * shape.half_stride + u);
        const int left_usable = step.left_mask == nullptr ? 1 : __ldg(step.left_mask + line + x);
        const int right_usable =
            step.right_mask == nullptr
                ? 1
                : __ldg(step.right_mask + line + clamped((q + 8) >> 4, 0, shape.width - 1));
        int disparity = kNoDisparity, confidence = 0;
        if (any && stands != kDoubtful && left_usable != 0) {
            const bool known = stands == kSettled;
            const bool good = refined.peak && q >= 0 && right_usable != 0 && refined.textured &&
                              score >= (known ? kTrustedScore : shape.refine_score);
            if (good || known) {
                disparity = good ? refined_disparity : hypothesis;
                confidence = clamped(good ? score >> 4 : score >> 5, 1, 255);
            }
        }
        const int at = y * shape.full_stride + x, given = y * shape.width + x;
        step.hypothesis[at] = static_cast<int16_t>(hypothesis);
        step.evidence[at] = static_cast<int16_t>(disparity);
        step.confidence[at] = static_cast<uint8_t>(confidence);
        if (step.given_hypothesis != nullptr)
            step.given_hypothesis[given] = static_cast<int16_t>(hypothesis);
        if (step.given_refined != nullptr)
            step.given_refined[given] = static_cast<int16_t>(refined_disparity);
        if (step.given_score != nullptr) step.given_score[given] = static_cast<int16_t>(score);
    }
}

}  // namespace

void record_refine(Recorder& recorder, const RefineStep& step) {
    const auto columns = static_cast<uint32_t>(step.shape.width),
               rows = static_cast<uint32_t>(step.shape.height);
    const dim3 blocks(cover(columns, kRefineTile), cover(rows, kRefineTile));
    with_radius(step.shape.refine_radius, [&]<int kRadius>(std::integral_constant<int, kRadius>) {
        recorder.launch(refine<kRadius>, {blocks, dim3(kThreads), sizeof(Block<kRadius>)}, step);
    });
}

}  // namespace defrec::cuda
