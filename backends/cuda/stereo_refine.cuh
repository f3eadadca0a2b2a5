// Section 8 of docs/stages/stereo.md for a tile of pixels.
#pragma once
#include "backends/cuda/stereo_windows.cuh"

namespace defrec::cuda {
namespace {

constexpr int kRefineTile = 32, kRefineRun = 8, kRefineThreads = 160;

template <int kRadius>
struct RefineTile {
    static constexpr int kSide = kRefineTile + 2 * kRadius;
    // Of sums along columns; so that rows eight apart in four words each do not share banks.
    static constexpr int kStride = (kSide + 3) / 8 * 8 + 4;
    static_assert(kStride >= kSide);
    // Left gray; and the right image seen through the hypothesis one pixel to the left, on the spot and one to the right, 9 bits each. 0
    // outside the image.
    uint2 cells[kSide][kSide];
    alignas(16) int columns[3][kRefineTile][kStride];

    // What comes out: in the place of `columns`.
    __device__ int& result(int column, int row) { return columns[0][row][column]; }
};

// A refined pixel in a word.
struct Refined {
    int move;  // of the disparity; not more than 16 either way
    int score;
    bool peak, textured;
};
__device__ __forceinline__ int pack(const Refined& r) { return r.score * (1 << 16) + (r.textured << 7) + (r.peak << 6) + (r.move + 16); }
__device__ __forceinline__ Refined unpack(int word) { return {(word & 63) - 16, word >> 16, (word >> 6 & 1) != 0, (word >> 7 & 1) != 0}; }
__device__ __forceinline__ int moved(int hypothesis, int move) { return clamped(hypothesis + move, 0, 32000); }

// The pixels x - 1 .. x + 2 of a row, read clamped. The row begins at a multiple of 4 bytes and its last word is whole.
__device__ __forceinline__ uint32_t four_around(const uint8_t* row, int x, int width) {
    const int first = x - 1;
    if (first >= 0 && first + 3 < width) {
        const auto* words = reinterpret_cast<const uint32_t*>(row) + (first >> 2);
        const uint32_t low = words[0];
        return (first & 3) == 0 ? low : __funnelshift_r(low, words[1], 8 * (first & 3));
    }
    uint32_t pixels = 0;
#pragma unroll
    for (int k = 0; k < 4; ++k) pixels |= uint32_t{row[clamped(first + k, 0, width - 1)]} << (8 * k);
    return pixels;
}

// right: the row of the right image.
__device__ __forceinline__ uint2 refine_cell(int left, const uint8_t* right, int hypothesis, int x, int width) {
    const int p = 16 * x - (hypothesis == kNoDisparity ? 0 : hypothesis);
    const auto part = static_cast<uint32_t>(p & 15);
    const uint32_t pixels = four_around(right, p >> 4, width), weights = (16 - part) | part << 8;
    const uint32_t before = __dp4a(pixels, weights, 4u) >> 3, here = __dp4a(pixels, weights << 8, 4u) >> 3, after = __dp4a(pixels, weights << 16, 4u) >> 3;
    return make_uint2(static_cast<uint32_t>(left), before | here << 9 | after << 18);
}

// floor(a / b) where that is within 40 of 0, else something beyond. b > 0, below 2^24.
__device__ __forceinline__ int small_quotient(int a, int b) {
    const float guess = fmaxf(-40.0f, fminf(__fdividef(static_cast<float>(a), static_cast<float>(b)), 40.0f));
    const int quotient = static_cast<int>(floorf(guess)), rest = a - quotient * b;
    return quotient + (rest >= b) - (rest < 0);
}

// Windows of the tile from its cells; the results are there when it returns. least_variance(n): of texture, in a window of n pixels.
template <int kRadius, class LeastVariance>
__device__ __forceinline__ void refine_tile(RefineTile<kRadius>& tile, int left, int top, int width, int height, LeastVariance&& least_variance) {
    constexpr int kRun = kRefineRun, kReach = kRun + 2 * kRadius, kSide = RefineTile<kRadius>::kSide, kQuads = (kReach + 3) / 4;
    const int thread = static_cast<int>(threadIdx.x);
    const bool scores = thread < kRefineTile * (kRefineTile / kRun);
    const int row = thread % kRefineTile, column = thread / kRefineTile * kRun;
    const int y = top + row, window_height = min(y + kRadius, height - 1) - max(y - kRadius, 0) + 1;
    const auto window_size = [&](int m) {
        const int x = left + column + m;
        return static_cast<uint32_t>((min(x + kRadius, width - 1) - max(x - kRadius, 0) + 1) * window_height);
    };
    uint32_t left_sum[kRun];
    float left_root[kRun];
    int z[3][kRun];
    bool textured[kRun];
#pragma unroll
    for (int image = 0; image < 4; ++image) {  // the left one, then the three of the right one
        for (int i = thread; i < kSide * (kRefineTile / kRun); i += kRefineThreads) {
            const int at = i % kSide, first = i / kSide * kRun;
            int gray[kReach], value[kReach];
#pragma unroll
            for (int v = 0; v < kReach; ++v) {
                const uint2 cell = tile.cells[first + v][at];
                gray[v] = static_cast<int>(cell.x);
                value[v] = image == 0 ? gray[v] : static_cast<int>(cell.y >> (9 * (image == 0 ? 0 : image - 1)) & 511);
            }
            int sum = 0, square = 0, product = 0;
#pragma unroll
            for (int v = 0; v < kReach; ++v) {
                sum += value[v];
                square += value[v] * value[v];
                if (image != 0) product += gray[v] * value[v];
                if (v < 2 * kRadius) continue;
                const int out = v - 2 * kRadius;
                tile.columns[0][first + out][at] = sum;
                tile.columns[1][first + out][at] = square;
                if (image != 0) tile.columns[2][first + out][at] = product;
                sum -= value[out];
                square -= value[out] * value[out];
                if (image != 0) product -= gray[out] * value[out];
            }
        }
        __syncthreads();
        if (scores) {
            int line[3][4 * kQuads], sums[3][kRun];
#pragma unroll
            for (int s = 0; s < (image == 0 ? 2 : 3); ++s) {
                int used[kReach];
#pragma unroll
                for (int q = 0; q < kQuads; ++q)
                    *reinterpret_cast<int4*>(&line[s][4 * q]) = *reinterpret_cast<const int4*>(&tile.columns[s][row][column + 4 * q]);
#pragma unroll
                for (int u = 0; u < kReach; ++u) used[u] = line[s][u];
                sum_along<kRadius, kRun>(used, sums[s]);
            }
#pragma unroll
            for (int m = 0; m < kRun; ++m) {
                // Products may wrap round; their differences fit.
                const uint32_t n = window_size(m), sum = static_cast<uint32_t>(sums[0][m]);
                const auto variance = static_cast<int>(n * static_cast<uint32_t>(sums[1][m]) - sum * sum);
                // Where it is 0, so are the covariances that the root multiplies.
                const float root = inverse_root_of_positive(variance);
                if (image == 0) {
                    left_sum[m] = sum;
                    left_root[m] = root * 0x1p20f;
                    textured[m] = variance >= least_variance(n);
                } else {
                    const auto covariance = static_cast<int>(n * static_cast<uint32_t>(sums[2][m]) - left_sum[m] * sum);
                    z[image == 0 ? 0 : image - 1][m] = static_cast<int>((static_cast<float>(covariance) * root) * left_root[m]);
                }
            }
        }
        __syncthreads();
    }
    if (scores) {
#pragma unroll
        for (int m = 0; m < kRun; ++m) {
            Refined refined{0, max(z[0][m], max(z[1][m], z[2][m])) >> 8, false, textured[m]};
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
