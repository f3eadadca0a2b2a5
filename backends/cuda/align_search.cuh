// Stage align, section 4: displacements scored, the even ones and then those round the best of
// them. A lane has one of them at a time, or some rows of it where they are few; its sums are dot
// products of four columns' pixels.
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
    if (4 * s.n < kMinUsableQuarters * pixels || live_variance < 1 || !(patch.variance >= 1.0f))
        return kUnscored;
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

// Sums of products with samples, which still have their mean.
template <int kRadius>
struct Correlation {
    using L = Layout<kRadius>;
    static constexpr uint32_t kOnes = 0x01010101;
    uint32_t n = 0, t = 0, high = 0, low = 0, i = 0, ii = 0, ti = 0;

    // Four pixels of a row from a byte on, which is that many bits behind words[0]; beyond the
    // patch's last column 0.
    __device__ static uint32_t pixels(const uint32_t* words, uint32_t bits, int block) {
        constexpr uint32_t kLast = 0xffffffffu >> (8 * (4 * L::kBlocks - L::kSide));
        const uint32_t bytes = __funnelshift_r(words[block], words[block + 1], bits);
        return block == L::kBlocks - 1 ? bytes & kLast : bytes;
    }
    // at: the word of the window with the displacement's first pixel, behind `bits` others' bits.
    __device__ void add_row(const Window<kRadius>& window, const Template<kRadius>& patch,
                            int32_t at, uint32_t bits, int32_t row) {
        const uint32_t* live = window.live + at + row * window.size.words;
        for (int block = 0; block < L::kBlocks; ++block) {
            const uint32_t bytes = pixels(live, bits, block);
            i = __dp4a(bytes, kOnes, i);
            ii = __dp4a(bytes, bytes, ii);
            ti = dot(patch.block(row, block), bytes, ti);
        }
    }
    __device__ void add_usable_row(const Window<kRadius>& window, const Template<kRadius>& patch,
                                   const Squares<kRadius>& squares, int32_t at, uint32_t bits,
                                   int32_t row) {
        const uint32_t* live = window.live + at + row * window.size.words;
        const uint32_t* usable = window.usable + at + row * window.size.words;
        for (int block = 0; block < L::kBlocks; ++block) {
            const uint2 samples = patch.block(row, block);
            const uint32_t seen = pixels(usable, bits, block), one = seen & kOnes,
                           bytes = pixels(live, bits, block) & seen;
            n = __dp4a(one, kOnes, n);
            t = dot(samples, one, t);
            high = dot(squares.high_block(row, block), one, high);
            low = dot(squares.low_block(row, block), one, low);
            i = __dp4a(bytes, kOnes, i);
            ii = __dp4a(bytes, bytes, ii);
            ti = dot(samples, bytes, ti);
        }
    }
    __device__ int32_t score(const Template<kRadius>& patch, const PatchTerms& whole,
                             bool masked) const {
        const uint32_t mean = static_cast<uint32_t>(patch.mean);
        WindowSums s{L::kPixels, patch.t, patch.tt, i, ii, static_cast<int32_t>(ti - mean * i)};
        if (!masked) return score_of(s, whole, L::kPixels);
        s.n = static_cast<int32_t>(n);
        s.t = static_cast<int32_t>(t - n * mean);
        s.tt = static_cast<int32_t>(4096 * high + low - 2 * mean * t + n * mean * mean);
        return score_of(s, patch_terms(max(s.n, 1), s.t, s.tt), L::kPixels);
    }
};

// value of this lane and of those `apart`, twice that, ... behind it, `count` in all.
__device__ uint32_t sum_of_lanes(uint32_t value, int32_t count, int32_t apart) {
    uint32_t sum = value;
    for (int32_t k = 1; k < count; ++k)
        sum += __shfl_down_sync(kAllLanes, value, static_cast<uint32_t>(k * apart));
    return sum;
}

// Displacements in rows, `step` apart, every second row `shift` further on.
struct Displacements {
    int2 first;
    int32_t columns, rows, step_x, step_y, shift;
    __device__ int2 at(int32_t index) const {
        const int32_t row = index / columns;
        return make_int2(first.x + index % columns * step_x + row % 2 * shift,
                         first.y + row * step_y);
    }
};

// Those that are scored first; the last of a row may lie beyond the radius.
__device__ Displacements first_displacements(int32_t radius) {
    const int32_t even = radius / 2 * 2;
    if (radius > kEvenSearch)
        return {make_int2(-radius, -radius), radius + 1, 2 * radius + 1, 2, 1, 1};
    return {make_int2(-even, -even), even + 1, even + 1, 2, 2, 0};
}

template <int kRadius>
class DisplacementSearch {
    using L = Layout<kRadius>;

  public:
    // at: the pixel that is not displaced. The window's first displacement is -search_radius.
    __device__ DisplacementSearch(const Level& level, const Window<kRadius>& window,
                                  const Template<kRadius>& patch, int2 at, int32_t search_radius)
        : level_(level), window_(window), patch_(patch), at_(at), radius_(search_radius) {
        if (window.masked) squares_ = square(patch);
        whole_ = patch_terms(L::kPixels, patch.t, patch.tt);
    }

    // The best displacement's index in the grid, and its score less what it costs; -1 and kUnscored
    // where none is scored.
    struct Best {
        int32_t place, score;
    };
    __device__ Best best_of(const Displacements& grid) const {
        const int32_t count = grid.columns * grid.rows, groups = min(count, kLanes),
                      parts = kLanes / groups, rows = (L::kSide + parts - 1) / parts;
        const int32_t lane = static_cast<int32_t>(threadIdx.x), first = lane / groups * rows,
                      last = lane < parts * groups ? min(first + rows, L::kSide) : 0;
        int32_t best = kUnscored, place = INT32_MAX;
        for (int32_t start = 0; start < count; start += groups) {
            const int32_t index = start + lane % groups;
            const int2 d = grid.at(min(index, count - 1));
            // Byte 4 of the window's second row is displacement (-search_radius, -search_radius)'s.
            const int32_t byte = 4 + d.x + radius_,
                          word = (1 + d.y + radius_) * window_.size.words + (byte >> 2);
            Correlation<kRadius> sums =
                correlate(word, 8 * static_cast<uint32_t>(byte & 3), first, last);
            if (parts > 1) add_up(sums, parts, groups);
            if (lane >= groups || index >= count || max(std::abs(d.x), std::abs(d.y)) > radius_ ||
                !level_.inside(make_int2(at_.x + d.x, at_.y + d.y), kRadius))
                continue;
            const int32_t score = sums.score(patch_, whole_, window_.masked);
            if (score == kUnscored) continue;
            const int32_t ranked = score - kDistancePenalty * (d.x * d.x + d.y * d.y);
            if (ranked <= best) continue;
            best = ranked;
            place = index;
        }
        const int32_t highest = max_of_warp(best);
        if (highest == kUnscored) return {-1, kUnscored};
        return {-max_of_warp(best == highest ? -place : INT32_MIN),
                highest};  // of equals the first
    }

    // Finds the displacement of the best score; false if there is none or it lies at the border.
    __device__ bool find(int2& displacement) const {
        const Displacements coarse = first_displacements(radius_);
        const int32_t place = best_of(coarse).place;
        if (place < 0) return false;
        const int2 best = coarse.at(place);
        const Displacements nearby{make_int2(best.x - 1, best.y - 1), 3, 3, 1, 1, 0};
        displacement = nearby.at(best_of(nearby).place);
        return max(std::abs(displacement.x), std::abs(displacement.y)) < radius_;
    }

    // That of no displacement; kUnscored where it has none.
    __device__ int32_t predicted_score() const {
        return best_of({make_int2(0, 0), 1, 1, 1, 1, 0}).score;
    }

  private:
    static constexpr int32_t kLanes = static_cast<int32_t>(kWarp);

    // Correlates the patch's rows first .. last - 1.
    __device__ Correlation<kRadius> correlate(int32_t word, uint32_t bits, int32_t first,
                                              int32_t last) const {
        Correlation<kRadius> sums;
        if (window_.masked)
            for (int32_t row = first; row < last; ++row)
                sums.add_usable_row(window_, patch_, squares_, word, bits, row);
        else
            for (int32_t row = first; row < last; ++row)
                sums.add_row(window_, patch_, word, bits, row);
        return sums;
    }
    __device__ void add_up(Correlation<kRadius>& sums, int32_t parts, int32_t groups) const {
        for (uint32_t* sum : {&sums.i, &sums.ii, &sums.ti})
            *sum = sum_of_lanes(*sum, parts, groups);
        if (!window_.masked) return;
        for (uint32_t* sum : {&sums.n, &sums.t, &sums.high, &sums.low})
            *sum = sum_of_lanes(*sum, parts, groups);
    }

    const Level& level_;
    const Window<kRadius>& window_;
    const Template<kRadius>& patch_;
    int2 at_;
    int32_t radius_;
    Squares<kRadius> squares_{};
    PatchTerms whole_;
};

}  // namespace
}  // namespace defrec::cuda
