// Stage stereo, the smoothing at half resolution and sections 8 to 10 at full: a block makes the
// hypothesis of the windows round its tile of samples, refines and classifies.
#include "backends/cuda/stereo_refine.cuh"
#include "backends/cuda/stereo_smooth.cuh"
#include "backends/cuda/stereo_steps.hpp"

namespace defrec::cuda {
namespace {

// For the runs of columns at a radius of 4, 39 x 4, and the half field, 12 x 12.
constexpr int kThreads = 160, kTileHeight = 16, kColumnRun = 4, kRun = 2;
// The half samples round the pixels of a tile, of which kHalfBefore lie before those in it.
constexpr int kHalfBefore = 2, kHalfSide = kTileWidth / 2 + 2 * kHalfBefore;
static_assert(kTileWidth == kTileHeight && kHalfSmoothRadius == 1);

template <int kRadius>
struct Block {
    RefineTile<kRadius, kTileHeight> tile;
    int half[kHalfSide][kHalfSide];
    // Hypotheses of the even row of each pair.
    int16_t hypotheses[decltype(tile)::kPairs][decltype(tile)::kColumns];
};

// Section 8, smoothing: what is refined at the half sample (i, j). If there are no disparities it
// smooths kNoDisparity, which stays.
__device__ __forceinline__ int smoothed_half(const RefineStep& step, int i, int j) {
    const int width = step.shape.half_samples_x, height = step.shape.half_samples_y;
    float cells[3][3];
#pragma unroll
    for (int v = 0; v < 3; ++v)
#pragma unroll
        for (int u = 0; u < 3; ++u) {
            // Outside the field some sample is read that does not matter.
            const int x = clamped(i + u - 1, 0, width - 1), y = clamped(j + v - 1, 0, height - 1),
                      disparity = __ldg(step.half + y * width + x);
            const bool inside = (x == i + u - 1) & (y == j + v - 1);
            cells[v][u] = inside ? static_cast<float>(disparity) : kMissing;
        }
    return static_cast<int>(smooth_centre(cells, kHalfSmoothRange));
}

// Section 9 at a pixel of the odd row y, and below it. Samples lie between the rows 4 v and 4 v +
// 1, so that the two rows have the same four. half[v - first_v][u - first_u] is the sample (u, v).
__device__ __forceinline__ void interpolate(const int (&half)[kHalfSide][kHalfSide], int first_u,
                                            int first_v, int x, int y, int (&hypotheses)[2]) {
    const int u = ((x - 1) >> 2) - first_u, v = ((y - 1) >> 2) - first_v;
    const int p = 7 - 2 * ((x - 1) & 3), q = 7 - 2 * ((y - 1) & 3);  // eighths
    const int a = half[v][u], b = half[v][u + 1], c = half[v + 1][u], d = half[v + 1][u + 1];
    const int above = p * a + (8 - p) * b, below = p * c + (8 - p) * d;
    const int sum = q * above + (8 - q) * below + 16;
    const bool one_surface =
        max(max(a, b), max(c, d)) - min(min(a, b), min(c, d)) <= kUpsampleRange;
    const int nearest = 2 * (q >= 4 ? (p >= 4 ? a : b) : (p >= 4 ? c : d));
    hypotheses[0] = one_surface ? sum >> 5 : nearest;
    hypotheses[1] = one_surface ? (sum - 2 * (above - below)) >> 5 : nearest;
}

// What is known of a sample before it is refined.
struct Known {
    int standing, left_usable;
};
__device__ __forceinline__ Known known_of(const RefineStep& step, int i, int j) {
    const StereoShape& shape = step.shape;
    const int u = min(i, shape.half_width - 1) >> 1, v = min(j, shape.half_height - 1) >> 1;
    return {__ldg(step.standing + v * shape.half_samples_x + u),
            step.left_mask != nullptr
                ? __ldg(step.left_mask + int64_t{2 * j} * shape.stride + 2 * i)
                : 1};
}

// Section 10 but for the speckles, for the sample (i, j).
__device__ __forceinline__ void classify(const RefineStep& step, const Known& known,
                                         const Refined& refined, int hypothesis, int i, int j) {
    const StereoShape& shape = step.shape;
    const int x = 2 * i, y = 2 * j;
    const bool any = hypothesis != kNoDisparity;
    const int refined_disparity = any ? moved(hypothesis, refined.move) : kNoDisparity,
              score = any ? refined.score : 0;
    const int64_t line = int64_t{y} * shape.stride;
    const int right = 16 * x - refined_disparity;
    const int right_usable =
        step.right_mask == nullptr
            ? 1
            : __ldg(step.right_mask + line + clamped((right + 8) >> 4, 0, shape.width - 1));
    // The least v with kTextureOne2 v >= texture^2 n^2.
    const uint64_t deviation =
        uint64_t{static_cast<uint32_t>(shape.texture)} * static_cast<uint32_t>(refined.n);
    const auto min_variance =
        static_cast<int>((deviation * deviation + kTextureOne2 - 1) / kTextureOne2);
    Found found{hypothesis, 0, 0};
    if (any && known.standing != kDoubtful && known.left_usable != 0) {
        const bool settled = known.standing == kSettled;
        const bool good = refined.peak && right >= 0 && right_usable != 0 &&
                          refined.variance >= min_variance &&
                          score >= (settled ? kTrustedScore : shape.refine_score);
        if (good || settled) {
            found.confidence = clamped(good ? score >> 4 : score >> 5, 1, 255);
            found.difference = kNoDifference + (good ? refined_disparity - hypothesis : 0);
        }
    }
    const int at = j * shape.samples_x + i;
    step.found[at] = pack_found(found);
    if (step.given_refined != nullptr)
        step.given_refined[at] = static_cast<int16_t>(refined_disparity);
    if (step.given_score != nullptr) step.given_score[at] = static_cast<int16_t>(score);
}

// Gives the hypotheses of the pixels of the tile.
__device__ void give_hypothesis(const RefineStep& step, const int (&half)[kHalfSide][kHalfSide],
                                int left, int top, bool any) {
    const StereoShape& shape = step.shape;
    for (int k = static_cast<int>(threadIdx.x); k < 2 * kTileWidth * (kTileHeight + 1);
         k += kThreads) {
        const int x = 2 * left + k % (2 * kTileWidth), pair = k / (2 * kTileWidth),
                  y = 2 * (top + pair) - 1;
        int two[2];
        interpolate(half, left / 2 - kHalfBefore, top / 2 - kHalfBefore, x, y, two);
#pragma unroll
        for (int v = 0; v < 2; ++v)
            if (pair + v > 0 && pair + v < kTileHeight + 1 && x < shape.width &&
                y + v < shape.height)
                step.given_hypothesis[(y + v) * shape.width + x] =
                    static_cast<int16_t>(any ? two[v] : kNoDisparity);
    }
}

template <int kRadius>
__global__ void __launch_bounds__(kThreads, 4) refine(RefineStep step) {
    Block<kRadius>& block = *dynamic_shared<Block<kRadius>>();
    using Tile = RefineTile<kRadius, kTileHeight>;
    auto& tile = block.tile;
    auto& half = block.half;
    auto& hypotheses = block.hypotheses;
    const StereoShape& shape = step.shape;
    const int left = static_cast<int>(blockIdx.x) * kTileWidth,
              top = static_cast<int>(blockIdx.y) * kTileHeight;
    const int thread = static_cast<int>(threadIdx.x);

    // All of the half field is there, or nothing.
    const bool any = __ldg(step.half) != kNoDisparity;
    const int first_u = left / 2 - kHalfBefore, first_v = top / 2 - kHalfBefore;
    for (int k = thread; k < kHalfSide * kHalfSide; k += kThreads) {
        const int column = k % kHalfSide, row = k / kHalfSide, u = first_u + column,
                  v = first_v + row;
        const int i = clamped(u, 0, shape.half_samples_x - 1),
                  j = clamped(v, 0, shape.half_samples_y - 1), smoothed = smoothed_half(step, i, j);
        half[row][column] = max(smoothed, 0);
        const bool owned = u == i && v == j && u >= left / 2 && u < (left + kTileWidth) / 2 &&
                           v >= top / 2 && v < (top + kTileHeight) / 2;
        if (step.given_half != nullptr && owned)
            step.given_half[v * shape.half_samples_x + u] = static_cast<int16_t>(smoothed);
    }
    __syncthreads();
    const GrayPair images{step.left, step.right, shape.width, shape.height,
                          gray_stride(shape.full_stride)};
    make_pairs<kThreads>(tile, images, left, top, [&](int tile_x, int tile_y, int(&two)[2]) {
        interpolate(half, first_u, first_v, 2 * left + tile_x, 2 * top + tile_y, two);
        hypotheses[(tile_y - Tile::kFirstRow) / 2][tile_x + kRadius] = static_cast<int16_t>(two[1]);
    });
    if (step.given_hypothesis != nullptr) give_hypothesis(step, half, left, top, any);
    __syncthreads();
    sum_columns<kThreads, kColumnRun>(tile);
    __syncthreads();
    constexpr int kRuns = kTileWidth / kRun;
    for (int k = thread; k < kTileHeight * kRuns; k += kThreads) {
        const int column = k % kRuns * kRun, row = k / kRuns, i = left + column, j = top + row;
        if (i >= shape.samples_x || j >= shape.samples_y) continue;
        Known known[kRun];
#pragma unroll
        for (int m = 0; m < kRun; ++m)
            known[m] = known_of(step, min(i + m, shape.samples_x - 1), j);
        Refined refined[kRun];
        refine_run<kRun>(tile, images, column, row, 2 * i, 2 * j, refined);
#pragma unroll
        for (int m = 0; m < kRun; ++m) {
            constexpr int kPairsAbove = -(Tile::kFirstRow + 1) / 2;
            const int hypothesis = hypotheses[row + kPairsAbove][2 * (column + m) + kRadius];
            if (i + m < shape.samples_x)
                classify(step, known[m], refined[m], any ? hypothesis : kNoDisparity, i + m, j);
        }
    }
}

}  // namespace

void record_refine(Recorder& recorder, const RefineStep& step) {
    const auto columns = static_cast<uint32_t>(step.shape.samples_x),
               rows = static_cast<uint32_t>(step.shape.samples_y);
    const dim3 blocks(cover(columns, kTileWidth), cover(rows, kTileHeight));
    with_radius(step.shape.refine_radius, [&]<int kRadius>(std::integral_constant<int, kRadius>) {
        recorder.launch(refine<kRadius>, {blocks, dim3(kThreads), sizeof(Block<kRadius>)}, step);
    });
}

}  // namespace defrec::cuda
