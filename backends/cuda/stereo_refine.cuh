// Section 8 of docs/stages/stereo.md for a tile of samples.
#pragma once
#include <type_traits>

#include "backends/cuda/stereo_windows.cuh"

namespace defrec::cuda {
namespace {

constexpr int kTileWidth = 16;  // samples

// Pixels round samples in pairs of rows, the first of them odd in the image. A window is kRadius
// whole pairs and a row of its own: above them for an even radius, below for an odd one.
template <int kRadius, int kTileHeight>
struct RefineTile {
    static constexpr int kHeight = kTileHeight;
    static constexpr bool kRowAbove = kRadius % 2 == 0;
    static constexpr int kColumns = 2 * kTileWidth - 1 + 2 * kRadius, kPairs = kHeight + kRadius;
    static constexpr int kFirstRow = -kRadius - kRowAbove;  // of the first pair, from the tile's
    // Elements in a row of sums along columns, as far as scores are read in vectors of four.
    static constexpr int kStride = (kColumns + 3) / 4 * 4;
    static constexpr int kPlanes = 11;
    // The right image seen through the hypothesis one pixel to the left, on the spot and one to the
    // right, a row in each half; and left gray, a row in each byte. 0 outside the image.
    uint4 pairs[kPairs][kColumns];
    // Sums along the windows' columns of L and L L; and of W, W W and L W for each of the three W.
    alignas(16) int columns[kPlanes][kHeight][kStride];
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

// The images of a level, whose rows have margins, which are read instead of the repetition of
// their ends.
struct GrayPair {
    const uint8_t *left, *right;
    int width, height, stride;
};

// Two rows of a column from the odd one y on, through the hypotheses there, which are not negative.
__device__ __forceinline__ uint4 refine_pair(const GrayPair& images, int x, int y,
                                             const int (&hypotheses)[2]) {
    const int at_x = clamped(x, 0, images.width - 1);
    uint32_t before[2], here[2], after[2], left[2];
#pragma unroll
    for (int k = 0; k < 2; ++k) {
        // Outside the image some pixel is read that does not matter.
        const int at_y = clamped(y + k, 0, images.height - 1), line = at_y * images.stride;
        const int p = 16 * at_x - hypotheses[k];
        const int first = max(p >> 4, -3) - 1;  // further out all four are the first pixel
        const auto* const words =
            reinterpret_cast<const uint32_t*>(images.right + line + (first & ~3));
        const uint32_t low = __ldg(words), high = __ldg(words + 1),
                       gray = __ldg(images.left + line + at_x);
        const bool inside = (x == at_x) & (y + k == at_y);
        // The shift counts modulo 32. 16 - f and f, f = p & 15.
        const uint32_t pixels = __funnelshift_r(low, high, 8 * static_cast<uint32_t>(first)),
                       weights = inside ? static_cast<uint32_t>(16 + 255 * (p & 15)) : 0;
        before[k] = __dp4a(pixels, weights, 4u) >> 3;
        here[k] = __dp4a(pixels, weights << 8, 4u) >> 3;
        after[k] = __dp4a(pixels, weights << 16, 4u) >> 3;
        left[k] = inside ? gray : 0;
    }
    constexpr uint32_t kLowerHalves = 0x5410;
    return make_uint4(__byte_perm(before[0], before[1], kLowerHalves),
                      __byte_perm(here[0], here[1], kLowerHalves),
                      __byte_perm(after[0], after[1], kLowerHalves), left[0] | left[1] << 8);
}

// Makes the tile's pairs: hypotheses_of(tile_x, tile_y, two) gives those of the pixel (tile_x,
// tile_y) from the tile's first and of the one below. By kThreads threads; one stays in its column.
template <int kThreads, int kRadius, int kHeight, class Hypotheses>
__device__ __forceinline__ void make_pairs(RefineTile<kRadius, kHeight>& tile,
                                           const GrayPair& images, int left, int top,
                                           Hypotheses&& hypotheses_of) {
    using Tile = RefineTile<kRadius, kHeight>;
    constexpr int kRows = kThreads / Tile::kColumns;  // of pairs, at once
    const int column = static_cast<int>(threadIdx.x) % Tile::kColumns,
              first = static_cast<int>(threadIdx.x) / Tile::kColumns;
    if (first >= kRows) return;
#pragma unroll
    for (int round = 0; round < (Tile::kPairs + kRows - 1) / kRows; ++round) {
        const int pair = first + round * kRows;
        if (Tile::kPairs % kRows != 0 && pair >= Tile::kPairs) break;
        const int tile_x = column - kRadius, tile_y = Tile::kFirstRow + 2 * pair;
        int two[2];
        hypotheses_of(tile_x, tile_y, two);
        tile.pairs[pair][column] = refine_pair(images, 2 * left + tile_x, 2 * top + tile_y, two);
    }
}

// Sums along the columns of windows of kRun rows of samples from `row` on.
template <int kRun, int kRadius, int kHeight>
__device__ __forceinline__ void sum_column(RefineTile<kRadius, kHeight>& tile, int column,
                                           int row) {
    using Tile = RefineTile<kRadius, kHeight>;
    constexpr int kPairs = kRun + kRadius, kAbove = Tile::kRowAbove;
    uint4 pairs[kPairs];
#pragma unroll
    for (int q = 0; q < kPairs; ++q) pairs[q] = tile.pairs[row + q][column];
    // A plane's sums from what of_pair gives for a whole pair, and alone for the row that a window
    // has without the other.
    const auto give = [&](int plane, auto&& of_pair, auto&& alone) {
        int of[kPairs], sum = 0;
#pragma unroll
        for (int q = kAbove; q < kPairs - 1 + kAbove; ++q) of[q] = of_pair(pairs[q]);
#pragma unroll
        for (int q = kAbove; q < kAbove + kRadius; ++q) sum += of[q];
#pragma unroll
        for (int s = 0; s < kRun; ++s) {
            tile.columns[plane][row + s][column] =
                sum + alone(pairs[kAbove != 0 ? s : s + kRadius]);
            if (s < kRun - 1) sum += of[s + kAbove + kRadius] - of[s + kAbove];
        }
    };
    const auto one_row = [](uint32_t word) { return kAbove != 0 ? word >> 16 : word & 0xffff; };
    const auto one_gray = [](uint32_t word) { return kAbove != 0 ? word >> 8 : word & 0xff; };
    const auto sum_of = [&](int plane, auto&& word) {
        give(
            plane,
            [&](const uint4& p) { return static_cast<int>(__dp2a_lo(word(p), 0x0101u, 0u)); },
            [&](const uint4& p) { return static_cast<int>(one_row(word(p))); });
        give(
            plane + 1,
            [&](const uint4& p) {
                const uint32_t low = word(p) & 0xffff, high = word(p) >> 16;
                return static_cast<int>(low * low + high * high);
            },
            [&](const uint4& p) {
                const uint32_t value = one_row(word(p));
                return static_cast<int>(value * value);
            });
        give(
            plane + 2,
            [&](const uint4& p) { return static_cast<int>(__dp2a_lo(word(p), p.w, 0u)); },
            [&](const uint4& p) { return static_cast<int>(one_row(word(p)) * one_gray(p.w)); });
    };
    give(
        0, [](const uint4& p) { return static_cast<int>(__dp4a(p.w, 0x0101u, 0u)); },
        [&](const uint4& p) { return static_cast<int>(one_gray(p.w)); });
    give(
        1, [](const uint4& p) { return static_cast<int>(__dp4a(p.w, p.w, 0u)); },
        [&](const uint4& p) {
            const uint32_t value = one_gray(p.w);
            return static_cast<int>(value * value);
        });
    sum_of(2, [](const uint4& p) { return p.x; });
    sum_of(5, [](const uint4& p) { return p.y; });
    sum_of(8, [](const uint4& p) { return p.z; });
}

// From the pairs; by kThreads threads that have kRun rows of a column each.
template <int kThreads, int kRun, int kRadius, int kHeight>
__device__ __forceinline__ void sum_columns(RefineTile<kRadius, kHeight>& tile) {
    constexpr int kColumns = RefineTile<kRadius, kHeight>::kColumns;
    static_assert(kHeight % kRun == 0);
    for (int i = static_cast<int>(threadIdx.x); i < kColumns * (kHeight / kRun); i += kThreads)
        sum_column<kRun>(tile, i % kColumns, i / kColumns * kRun);
}

struct Refined {
    int move;  // of the disparity; not more than 16 either way
    int score;
    bool peak;
    int variance, n;
};
__device__ __forceinline__ int moved(int hypothesis, int move) {
    return clamped(hypothesis + move, 0, kMaxDisparity);
}

// floor(a / b) where that is within 40 of 0, else something beyond. b > 0, below 2^24.
__device__ __forceinline__ int small_quotient(int a, int b) {
    const float guess =
        fmaxf(-40.0f, fminf(__fdividef(static_cast<float>(a), static_cast<float>(b)), 40.0f));
    const int quotient = static_cast<int>(floorf(guess)), rest = a - quotient * b;
    return quotient + (rest >= b) - (rest < 0);
}

// Windows of kRun samples, 1 or 2, from the sums along their columns.
template <int kRadius, int kRun>
__device__ __forceinline__ void sum_run(const int* columns, int (&sums)[kRun]) {
    constexpr int kUsed = 2 * kRun - 1 + 2 * kRadius;
    alignas(16) int line[(kUsed + 3) / 4 * 4];
    int used[kUsed];
    if (kRun == 1) {
#pragma unroll
        for (int u = 0; u < kUsed; u += 2)
            *reinterpret_cast<int2*>(line + u) = *reinterpret_cast<const int2*>(columns + u);
    } else {
#pragma unroll
        for (int u = 0; u < kUsed; u += 4)
            *reinterpret_cast<int4*>(line + u) = *reinterpret_cast<const int4*>(columns + u);
    }
#pragma unroll
    for (int u = 0; u < kUsed; ++u) used[u] = line[u];
    sum_along<kRadius, kRun, 2>(used, sums);
}

// The samples (column + m, row) of the tile, of which (x, y) is the first one's pixel in the
// images.
template <int kRun, int kRadius, int kHeight>
__device__ __forceinline__ void refine_run(const RefineTile<kRadius, kHeight>& tile,
                                           const GrayPair& images, int column, int row, int x,
                                           int y, Refined (&refined)[kRun]) {
    const int width = images.width,
              window_height = min(y + kRadius, images.height - 1) - max(y - kRadius, 0) + 1;
    uint32_t n[kRun], left_sum[kRun];
    float left_root[kRun];
    int z[3][kRun], sums[kRun], squares[kRun], products[kRun];
    const auto read = [&](int plane, int(&to)[kRun]) {
        sum_run<kRadius, kRun>(&tile.columns[plane][row][2 * column], to);
    };
    // Products may wrap round; their differences fit. Where a variance is 0, so are the covariances
    // that its root multiplies.
    read(0, sums);
    read(1, squares);
#pragma unroll
    for (int m = 0; m < kRun; ++m) {
        const int at = x + 2 * m;
        n[m] = static_cast<uint32_t>((min(at + kRadius, width - 1) - max(at - kRadius, 0) + 1) *
                                     window_height);
        left_sum[m] = static_cast<uint32_t>(sums[m]);
        refined[m].n = static_cast<int>(n[m]);
        refined[m].variance =
            static_cast<int>(n[m] * static_cast<uint32_t>(squares[m]) - left_sum[m] * left_sum[m]);
        left_root[m] = inverse_root_of_positive(refined[m].variance) * 0x1p20f;
    }
#pragma unroll
    for (int k = 0; k < 3; ++k) {
        read(3 * k + 2, sums);
        read(3 * k + 3, squares);
        read(3 * k + 4, products);
#pragma unroll
        for (int m = 0; m < kRun; ++m) {
            const auto sum = static_cast<uint32_t>(sums[m]);
            const auto variance =
                static_cast<int>(n[m] * static_cast<uint32_t>(squares[m]) - sum * sum);
            const auto covariance =
                static_cast<int>(n[m] * static_cast<uint32_t>(products[m]) - left_sum[m] * sum);
            z[k][m] = static_cast<int>(
                (static_cast<float>(covariance) * inverse_root_of_positive(variance)) *
                left_root[m]);
        }
    }
#pragma unroll
    for (int m = 0; m < kRun; ++m) {
        refined[m].score = max(z[0][m], max(z[1][m], z[2][m])) >> 8;
        refined[m].move = 0;
        refined[m].peak = false;
        const int bend = 2 * z[1][m] - z[0][m] - z[2][m];
        if (bend > 0) {
            const int top_at = small_quotient(16 * (z[0][m] - z[2][m]) + bend, 2 * bend);
            refined[m].peak = abs(top_at) <= 16;
            refined[m].move = clamped(top_at, -16, 16);
        }
    }
}

}  // namespace
}  // namespace defrec::cuda
