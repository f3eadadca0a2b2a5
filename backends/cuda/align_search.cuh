// Stage align, section 4: every displacement scored. A lane has four displacements in a row at a
// time; their sums are dot products of four columns' pixels.
#pragma once
#include "backends/cuda/align_window.cuh"

namespace defrec::cuda {
namespace {

// Sums of a displacement over the pixels of its window that are usable; t is less its mean, i the
// live image.
struct WindowSums {
    int32_t n, t, tt;
    uint32_t i, ii;
    int32_t ti;
};
// What the patch contributes to a score.
struct PatchTerms {
    float inverse_n, root_n, variance, inverse_root;
};
__device__ PatchTerms patch_terms(int32_t n, int32_t t, int32_t tt) {
    const float count = static_cast<float>(n), inverse_n = __frcp_rn(count);
    const float variance =
        static_cast<float>(tt) - (static_cast<float>(t) * static_cast<float>(t)) * inverse_n;
    return {inverse_n, __fsqrt_rn(count), variance, reciprocal_sqrt(variance)};
}

// ZNCC, 1/65536.
__device__ int32_t score_of(const WindowSums& s, const PatchTerms& patch, int32_t pixels) {
    const int32_t live_variance =
        static_cast<int32_t>(static_cast<uint32_t>(s.n) * s.ii - s.i * s.i);
    if (4 * s.n < 3 * pixels || live_variance < 1 || !(patch.variance >= 1.0f)) return kUnscored;
    const float covariance = static_cast<float>(s.ti) -
                             (static_cast<float>(s.t) * static_cast<float>(s.i)) * patch.inverse_n;
    const float z =
        ((covariance * patch.inverse_root) * reciprocal_sqrt(static_cast<float>(live_variance))) *
        patch.root_n;
    return static_cast<int32_t>(std::floor(z * static_cast<float>(kOneScore) + 0.5f));
}

// The squares of the samples in two parts, 4096 high + low, in rows of blocks: dot products take 16
// bits.
template <int kRadius>
struct Squares {
    using L = Layout<kRadius>;
    const uint16_t *high, *low;
    __device__ uint2 high_block(int32_t row, int32_t index) const {
        return reinterpret_cast<const uint2*>(high)[row * L::kBlocks + index];
    }
    __device__ uint2 low_block(int32_t row, int32_t index) const {
        return reinterpret_cast<const uint2*>(low)[row * L::kBlocks + index];
    }
};
template <int kRadius>
__device__ Squares<kRadius> square(const Template<kRadius>& patch) {
    using L = Layout<kRadius>;
    constexpr int kColumns = 4 * L::kBlocks;
    alignas(8) __shared__ uint16_t high[L::kSide * kColumns], low[L::kSide * kColumns];
    for (int32_t i = static_cast<int32_t>(threadIdx.x); i < L::kSide * kColumns; i += kWarp) {
        const int32_t value = patch.at(min(i % kColumns, L::kSide - 1), i / kColumns),
                      product = value * value;
        high[i] = static_cast<uint16_t>(product >> 12);
        low[i] = static_cast<uint16_t>(product & 4095);
    }
    __syncwarp();
    return {high, low};
}

__device__ uint32_t dot(uint2 halves, uint32_t bytes, uint32_t sum) {
    return __dp2a_hi(halves.y, bytes, __dp2a_lo(halves.x, bytes, sum));
}

// Displacements x .. x + 3, each with its own sums. at: the word of the window with the first one's
// first pixel. Sums of products with samples, which still have their mean.
template <int kRadius>
struct Strip {
    using L = Layout<kRadius>;
    static constexpr uint32_t kOnes = 0x01010101;
    uint32_t n[4] = {}, t[4] = {}, high[4] = {}, low[4] = {}, i[4] = {}, ii[4] = {}, ti[4] = {};

    // Pixels k .. k + 3 of two words; beyond the patch's last column 0.
    __device__ static uint32_t pixels(uint32_t word, uint32_t next, int k, int block) {
        constexpr uint32_t kLast = 0xffffffffu >> (8 * (4 * L::kBlocks - L::kSide));
        const uint32_t bytes =
            k == 0 ? word : __funnelshift_r(word, next, 8 * static_cast<uint32_t>(k));
        return block == L::kBlocks - 1 ? bytes & kLast : bytes;
    }
    __device__ void correlate(const Window<kRadius>& window, const Template<kRadius>& patch,
                              int32_t at) {
        for (int32_t row = 0; row < L::kSide; ++row) {
            const uint32_t* live = window.live + at + row * window.size.words;
            for (int block = 0; block < L::kBlocks; ++block) {
                const uint2 samples = patch.block(row, block);
                for (int k = 0; k < 4; ++k) {
                    const uint32_t bytes = pixels(live[block], live[block + 1], k, block);
                    i[k] = __dp4a(bytes, kOnes, i[k]);
                    ii[k] = __dp4a(bytes, bytes, ii[k]);
                    ti[k] = dot(samples, bytes, ti[k]);
                }
            }
        }
    }
    __device__ void correlate_usable(const Window<kRadius>& window, const Template<kRadius>& patch,
                                     const Squares<kRadius>& squares, int32_t at) {
        for (int32_t row = 0; row < L::kSide; ++row) {
            const uint32_t* live = window.live + at + row * window.size.words;
            const uint32_t* usable = window.usable + at + row * window.size.words;
            for (int block = 0; block < L::kBlocks; ++block) {
                const uint2 samples = patch.block(row, block),
                            upper = squares.high_block(row, block),
                            lower = squares.low_block(row, block);
                for (int k = 0; k < 4; ++k) {
                    const uint32_t seen = pixels(usable[block], usable[block + 1], k, block),
                                   one = seen & kOnes;
                    const uint32_t bytes = pixels(live[block], live[block + 1], k, block) & seen;
                    n[k] = __dp4a(one, kOnes, n[k]);
                    t[k] = dot(samples, one, t[k]);
                    high[k] = dot(upper, one, high[k]);
                    low[k] = dot(lower, one, low[k]);
                    i[k] = __dp4a(bytes, kOnes, i[k]);
                    ii[k] = __dp4a(bytes, bytes, ii[k]);
                    ti[k] = dot(samples, bytes, ti[k]);
                }
            }
        }
    }
};

// Finds the displacement of the best score round the pixel at; false if there is none or it lies at
// the border. The window's first displacement is -search_radius.
template <int kRadius>
__device__ bool search(const Level& level, const Window<kRadius>& window,
                       const Template<kRadius>& patch, int2 at, int32_t search_radius,
                       int2& displacement) {
    using L = Layout<kRadius>;
    const int32_t places = 2 * search_radius + 1, strips = (places + 3) / 4;  // in a row
    Squares<kRadius> squares{};
    if (window.masked) squares = square(patch);
    const PatchTerms whole = patch_terms(L::kPixels, patch.t, patch.tt);
    int32_t best = kUnscored, place = INT32_MAX;
    for (int32_t index = static_cast<int32_t>(threadIdx.x); index < strips * places;
         index += kWarp) {
        const int32_t y = index / strips, x = 4 * (index % strips),
                      word = (y + 1) * window.size.words + 1 + x / 4;
        Strip<kRadius> strip;
        if (window.masked)
            strip.correlate_usable(window, patch, squares, word);
        else
            strip.correlate(window, patch, word);
        for (int k = 0; k < 4; ++k) {
            const int2 d = make_int2(x + k - search_radius, y - search_radius);
            if (d.x > search_radius || !level.inside(make_int2(at.x + d.x, at.y + d.y), kRadius))
                continue;
            const uint32_t mean = static_cast<uint32_t>(patch.mean);
            WindowSums s{L::kPixels,  patch.t,
                         patch.tt,    strip.i[k],
                         strip.ii[k], static_cast<int32_t>(strip.ti[k] - mean * strip.i[k])};
            int32_t score = 0;
            if (window.masked) {
                const uint32_t n = strip.n[k], t = strip.t[k];
                s.n = static_cast<int32_t>(n);
                s.t = static_cast<int32_t>(t - n * mean);
                s.tt = static_cast<int32_t>(4096 * strip.high[k] + strip.low[k] - 2 * mean * t +
                                            n * mean * mean);
                score = score_of(s, patch_terms(max(s.n, 1), s.t, s.tt), L::kPixels);
            } else {
                score = score_of(s, whole, L::kPixels);
            }
            if (score == kUnscored) continue;
            const int32_t ranked = score - kDistancePenalty * (d.x * d.x + d.y * d.y);
            if (ranked <= best) continue;
            best = ranked;
            place = y * places + x + k;
        }
    }
    const int32_t highest = max_of_warp(best);
    if (highest == kUnscored) return false;
    place = -max_of_warp(best == highest ? -place : INT32_MIN);  // of equals the first
    displacement = make_int2(place % places - search_radius, place / places - search_radius);
    return max(std::abs(displacement.x), std::abs(displacement.y)) < search_radius;
}

}  // namespace
}  // namespace defrec::cuda
