// Section 8 of docs/stages/stereo.md for a tile of pixels.
#pragma once
#include <type_traits>

#include "backends/cuda/stereo_windows.cuh"

namespace defrec::cuda {
namespace {

constexpr int kRefineTile = 32, kRefineRun = 8;

// Its place is dynamic shared memory.
template <int kRadius>
struct RefineTile {
    static constexpr int kSide = kRefineTile + 2 * kRadius;
    // Of sums along columns; so that rows eight apart in four words each do not share banks.
    static constexpr int kStride = (kSide + 3) / 8 * 8 + 4;
    static_assert(kStride >= kSide);
    // Left gray; and the right image seen through the hypothesis one pixel to the left, on the spot
    // and one to the right, 9 bits each. 0 outside the image.
    uint2 cells[kSide][kSide];
    alignas(16) int columns[6][kRefineTile][kStride];

    // What comes out: in the place of `columns`.
    __device__ int& result(int column, int row) { return columns[0][row][column]; }
};

// Calls launch with a refinement radius, 2 to 6, as a constant: std::integral_constant<int,
// radius>.
template <class Launch>
void with_radius(int radius, Launch&& launch) {
    switch (radius) {
        case 2:
            return launch(std::integral_constant<int, 2>{});
        case 3:
            return launch(std::integral_constant<int, 3>{});
        case 4:
            return launch(std::integral_constant<int, 4>{});
        case 5:
            return launch(std::integral_constant<int, 5>{});
        default:
            return launch(std::integral_constant<int, 6>{});
    }
}

// A refined pixel in a word.
struct Refined {
    int move;  // of the disparity; not more than 16 either way
    int score;
    bool peak, textured;
};
__device__ __forceinline__ int pack(const Refined& r) {
    return r.score * (1 << 16) + (r.textured << 7) + (r.peak << 6) + (r.move + 16);
}
__device__ __forceinline__ Refined unpack(int word) {
    return {(word & 63) - 16, word >> 16, (word >> 6 & 1) != 0, (word >> 7 & 1) != 0};
}
__device__ __forceinline__ int moved(int hypothesis, int move) {
    return clamped(hypothesis + move, 0, 32000);
}

// right: the row of the right image, whose margins are read instead of its ends' repetition.
__device__ __forceinline__ uint2 refine_cell(int left, const uint8_t* right, int hypothesis,
                                             int x) {
    const int p = 16 * x - (hypothesis == kNoDisparity ? 0 : hypothesis);
    const auto part = static_cast<uint32_t>(p & 15);
    const int first = max(p >> 4, -3) - 1;  // further out all four are the first pixel
    const auto* const words = reinterpret_cast<const uint32_t*>(right) + (first >> 2);
    const uint32_t pixels =
                       __funnelshift_r(words[0], words[1], static_cast<uint32_t>(8 * (first & 3))),
                   weights = (16 - part) | part << 8;
    const uint32_t before = __dp4a(pixels, weights, 4u) >> 3,
                   here = __dp4a(pixels, weights << 8, 4u) >> 3,
                   after = __dp4a(pixels, weights << 16, 4u) >> 3;
    return make_uint2(static_cast<uint32_t>(left), before | here << 9 | after << 18);
}

// floor(a / b) where that is within 40 of 0, else something beyond. b > 0, below 2^24.
__device__ __forceinline__ int small_quotient(int a, int b) {
    const float guess =
        fmaxf(-40.0f, fminf(__fdividef(static_cast<float>(a), static_cast<float>(b)), 40.0f));
    const int quotient = static_cast<int>(floorf(guess)), rest = a - quotient * b;
    return quotient + (rest >= b) - (rest < 0);
}

// Sums of I, I I and L I along the columns of windows, I the image, as they move down kRefineRun
// rows. Image 0, the left one, to the planes 0 and 1; of those of the right one 1 and 3 to 3 .. 5,
// and 2 to 0 .. 2.
template <int kRadius, int kImage>
__device__ __forceinline__ void sum_column(RefineTile<kRadius>& tile, int at, int first) {
    constexpr int kReach = kRefineRun + 2 * kRadius, kPlane = kImage % 2 == 0 ? 0 : 3;
    constexpr bool kProduct = kImage != 0;
    int gray[kReach], value[kReach];
#pragma unroll
    for (int v = 0; v < kReach; ++v) {
        const uint2 cell = tile.cells[first + v][at];
        gray[v] = static_cast<int>(cell.x);
        value[v] =
            kImage == 0 ? gray[v] : static_cast<int>(cell.y >> (9 * (kImage - kProduct)) & 511);
    }
    int sum = 0, square = 0, product = 0;
#pragma unroll
    for (int v = 0; v < kReach; ++v) {
        sum += value[v];
        square += value[v] * value[v];
        if (kProduct) product += gray[v] * value[v];
        if (v < 2 * kRadius) continue;
        const int out = v - 2 * kRadius, row = first + out;
        tile.columns[kPlane][row][at] = sum;
        tile.columns[kPlane + 1][row][at] = square;
        if (kProduct) tile.columns[kPlane + 2][row][at] = product;
        sum -= value[out];
        square -= value[out] * value[out];
        if (kProduct) product -= gray[out] * value[out];
    }
}

// Two of the images: by the same threads where they are just enough for one, else by others.
template <int kRadius, int kThreads, int kFirst>
__device__ __forceinline__ void sum_columns(RefineTile<kRadius>& tile) {
    constexpr int kSide = RefineTile<kRadius>::kSide, kRuns = kSide * (kRefineTile / kRefineRun);
    constexpr bool kTogether = kThreads < 2 * kRefineTile * (kRefineTile / kRefineRun);
    for (int i = static_cast<int>(threadIdx.x); i < (kTogether ? kRuns : 2 * kRuns);
         i += kThreads) {
        const int at = i % kSide, first = i / kSide * kRefineRun;
        if (kTogether || i < kRuns) sum_column<kRadius, kFirst>(tile, at, first % kRefineTile);
        if (kTogether || i >= kRuns) sum_column<kRadius, kFirst + 1>(tile, at, first % kRefineTile);
    }
}

// Windows of kRun pixels from the sums along their columns.
template <int kRadius, int kRun>
__device__ __forceinline__ void sum_run(const int* columns, int (&sums)[kRun]) {
    constexpr int kReach = kRun + 2 * kRadius;
    alignas(16) int line[(kReach + 3) / 4 * 4];
    int used[kReach];
#pragma unroll
    for (int u = 0; u < kReach; u += 4)
        *reinterpret_cast<int4*>(line + u) = *reinterpret_cast<const int4*>(columns + u);
#pragma unroll
    for (int u = 0; u < kReach; ++u) used[u] = line[u];
    sum_along<kRadius, kRun>(used, sums);
}

// Windows of the tile from its cells, by kThreads threads that have kRun pixels of a row each; the
// results are there when it returns. least_variance(n): of texture, in a window of n pixels.
template <int kThreads, int kRun, int kRadius, class LeastVariance>
__device__ __forceinline__ void refine_tile(RefineTile<kRadius>& tile, int left, int top, int width,
                                            int height, LeastVariance&& min_variance) {
    static_assert(kThreads >= kRefineTile * (kRefineTile / kRun));
    const int thread = static_cast<int>(threadIdx.x);
    const bool scores = thread < kRefineTile * (kRefineTile / kRun);
    const int row = thread % kRefineTile, column = thread / kRefineTile * kRun;
    const int y = top + row, window_height = min(y + kRadius, height - 1) - max(y - kRadius, 0) + 1;
    const auto window_size = [&](int m) {
        const int x = left + column + m;
        return static_cast<uint32_t>((min(x + kRadius, width - 1) - max(x - kRadius, 0) + 1) *
                                     window_height);
    };
    uint32_t left_sum[kRun];
    float left_root[kRun];
    int z[3][kRun];
    uint32_t textured = 0;  // a bit for each pixel

    // Products may wrap round; their differences fit. Where a variance is 0, so are the covariances
    // that its root multiplies.
    const auto see_left = [&] {
        int sum[kRun], square[kRun];
        sum_run<kRadius, kRun>(&tile.columns[0][row][column], sum);
        sum_run<kRadius, kRun>(&tile.columns[1][row][column], square);
#pragma unroll
        for (int m = 0; m < kRun; ++m) {
            const uint32_t n = window_size(m);
            left_sum[m] = static_cast<uint32_t>(sum[m]);
            const auto variance =
                static_cast<int>(n * static_cast<uint32_t>(square[m]) - left_sum[m] * left_sum[m]);
            left_root[m] = inverse_root_of_positive(variance) * 0x1p20f;
            textured |= variance >= min_variance(n) ? 1u << m : 0u;
        }
    };
    const auto see_right = [&](int plane, int(&correlation)[kRun]) {
        int sums[kRun], squares[kRun], products[kRun];
        sum_run<kRadius, kRun>(&tile.columns[plane][row][column], sums);
        sum_run<kRadius, kRun>(&tile.columns[plane + 1][row][column], squares);
        sum_run<kRadius, kRun>(&tile.columns[plane + 2][row][column], products);
#pragma unroll
        for (int m = 0; m < kRun; ++m) {
            const uint32_t n = window_size(m), sum = static_cast<uint32_t>(sums[m]);
            const auto variance =
                static_cast<int>(n * static_cast<uint32_t>(squares[m]) - sum * sum);
            const auto covariance =
                static_cast<int>(n * static_cast<uint32_t>(products[m]) - left_sum[m] * sum);
            correlation[m] = static_cast<int>(
                (static_cast<float>(covariance) * inverse_root_of_positive(variance)) *
                left_root[m]);
        }
    };
    sum_columns<kRadius, kThreads, 0>(tile);
    __syncthreads();
    if (scores) {
        see_left();
        see_right(3, z[0]);
    }
    __syncthreads();
    sum_columns<kRadius, kThreads, 2>(tile);
    __syncthreads();
    if (scores) {
        see_right(0, z[1]);
        see_right(3, z[2]);
    }
    __syncthreads();
    if (scores) {
#pragma unroll
        for (int m = 0; m < kRun; ++m) {
            Refined refined{0, max(z[0][m], max(z[1][m], z[2][m])) >> 8, false,
                            (textured >> m & 1) != 0};
            const int bend = 2 * z[1][m] - z[0][m] - z[2][m];
            if (bend > 0) {
                const int top_at = small_quotient(16 * (z[0][m] - z[2][m]) + bend, 2 * bend);
                refined.peak = abs(top_at) <= 16;
                refined.move = clamped(top_at, -16, 16);
            }
            tile.result(column + m, row) = pack(refined);
        }
    }
    __syncthreads();
}

}  // namespace
}  // namespace defrec::cuda
