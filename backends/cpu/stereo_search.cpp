// The search of stereo at half resolution: window sums, correlation, winners, checks. Lanes are
// pixels of a row; the products of a column of the window are kept for each disparity and updated
// from row to row, the scores are never stored.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "backends/cpu/stereo_kernels.hpp"
#include "backends/stages/stereo.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/stereo_search.cpp"
#include <hwy/foreach_target.h>

#include "backends/cpu/stereo_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {

// Where the parts of the scratch memory lie. Rows have kMargin zeros on both sides; those of the
// right image enough for every x - d.
struct SearchScratch {
    SearchScratch(const SearchJob& job, int32_t* memory) {
        const size_t row = RowInts(job.c.half_width), reach = ReachInts(job.c.first + job.c.count);
        const auto take = [&](size_t before, size_t count) {
            int32_t* part = memory + before;
            memory += before + count;
            return part;
        };
        row_ints = row;
        columns = take(kMargin, row * size_t(job.c.count));
        best = take(kMargin, row * size_t((job.c.count + kGroup - 1) / kGroup));
        keys = take(kMargin, row);
        left_pairs = take(kMargin, row);
        left_sums = take(kMargin, row);
        left_squares = take(kMargin, row);
        right_sums = take(kMargin, row);
        right_squares = take(kMargin, row);
        left_variance = take(kMargin, row);
        left_mean = reinterpret_cast<float*>(take(kMargin, row));
        left_inverse = reinterpret_cast<float*>(take(kMargin, row));
        right_pairs = take(reach, row);
        right_best = take(reach, row);
        right_index = take(reach, row);
        right_sum = reinterpret_cast<float*>(take(reach, row));
        right_inverse = reinterpret_cast<float*>(take(reach, row));
    }
    // A row's elements up to the next row's: the margin of one is that of the next.
    static size_t RowInts(int width) { return (size_t(width) + 15) / 16 * 16 + kMargin; }
    static size_t ReachInts(int disparities) {
        return (size_t(disparities) + 15) / 16 * 16 + kMargin;
    }
    static size_t Total(const StereoConstants& c) {
        const size_t row = RowInts(c.half_width),
                     parts = size_t(c.count) + size_t((c.count + kGroup - 1) / kGroup) + 14;
        return parts * row + 11 * size_t{kMargin} + 5 * ReachInts(c.first + c.count);
    }

    size_t row_ints;
    int32_t *columns, *best, *keys, *left_pairs, *right_pairs;
    int32_t *left_sums, *left_squares, *right_sums,
        *right_squares;  // over the columns of the window
    int32_t *left_variance, *right_best, *right_index;
    float *left_mean, *left_inverse, *right_sum, *right_inverse;
};

// Pairs of centred values of two rows, the second times sign; a null row is zeros.
void MakePairs(const uint8_t* first, const uint8_t* second, int sign, int width, int32_t* pairs) {
    for (int x = 0; x < width; ++x) {
        const int a = first != nullptr ? first[x] - 128 : 0,
                  b = second != nullptr ? sign * (second[x] - 128) : 0;
        pairs[x] = (a & 0xffff) | int32_t(uint32_t(b) << 16);
    }
}

void UpdateColumnSums(const uint8_t* enter, const uint8_t* leave, int width, int32_t* sums,
                      int32_t* squares) {
    for (int x = 0; x < width; ++x) {
        const int a = enter[x] - 128, b = leave != nullptr ? leave[x] - 128 : 0;
        sums[x] += a - b;
        squares[x] += a * a - b * b;
    }
}

// The columns of a disparity, from where the first has a right pixel.
struct DisparityColumns {
    DisparityColumns(const SearchJob& job, const SearchScratch& s, int index)
        : begin((job.c.first + index) / int(hn::Lanes(I32())) * int(hn::Lanes(I32()))),
          left_pairs(s.left_pairs),
          right_pairs(s.right_pairs - job.c.first - index),
          sums(s.columns + size_t(index) * s.row_ints) {}
    // With the products of the pairs added.
    HWY_INLINE VI32 Update(int x) const {
        const I32 d;
        const VI32 products =
            PairProducts(hn::Load(d, left_pairs + x), hn::LoadU(d, right_pairs + x));
        const VI32 sum = hn::Add(hn::Load(d, sums + x), products);
        hn::Store(sum, d, sums + x);
        return sum;
    }

    int begin;
    const int32_t *left_pairs, *right_pairs;
    int32_t* sums;
};

HWY_INLINE void UpdateColumns(const SearchJob& job, const SearchScratch& s, int index) {
    const DisparityColumns columns(job, s, index);
    for (int x = columns.begin; x < job.c.half_width; x += int(hn::Lanes(I32()))) columns.Update(x);
}

// Sum, n^2 times variance and its inverse root of the windows round the row's pixels; 0 where a
// window is not inside.
HWY_INLINE void WindowStatistics(const int32_t* sums, const int32_t* squares, int x, int radius,
                                 int width, VI32& sum, VI32& variance, VF32& inverse) {
    const I32 d32;
    VI32 total = hn::Zero(d32), square = hn::Zero(d32);
    for (int u = -radius; u <= radius; ++u) {
        total = hn::Add(total, hn::LoadU(d32, sums + x + u));
        square = hn::Add(square, hn::LoadU(d32, squares + x + u));
    }
    const VI32 column = Columns(x);
    const auto inside = hn::And(hn::Gt(column, hn::Set(d32, radius - 1)),
                                hn::Lt(column, hn::Set(d32, width - radius)));
    const int n = (2 * radius + 1) * (2 * radius + 1);
    sum = hn::IfThenElseZero(inside, total);
    variance = hn::IfThenElseZero(inside,
                                  hn::Sub(hn::Mul(hn::Set(d32, n), square), hn::Mul(total, total)));
    inverse = InverseRoot(variance);
}

void RowStatistics(const SearchJob& job, const SearchScratch& s) {
    const I32 d32;
    const F32 df;
    const float one_over_n = 1.0f / float((2 * job.c.radius + 1) * (2 * job.c.radius + 1));
    for (int x = 0; x < job.c.half_width; x += int(hn::Lanes(d32))) {
        VI32 sum, variance;
        VF32 inverse;
        WindowStatistics(s.left_sums, s.left_squares, x, job.c.radius, job.c.half_width, sum,
                         variance, inverse);
        hn::Store(variance, d32, s.left_variance + x);
        hn::Store(inverse, df, s.left_inverse + x);
        hn::Store(hn::Mul(hn::ConvertTo(df, sum), hn::Set(df, one_over_n)), df, s.left_mean + x);
        WindowStatistics(s.right_sums, s.right_squares, x, job.c.radius, job.c.half_width, sum,
                         variance, inverse);
        hn::Store(inverse, df, s.right_inverse + x);
        hn::Store(hn::ConvertTo(df, sum), df, s.right_sum + x);
    }
}

// Scores of one disparity from sums over windows, into the best of its group and of the right
// pixels.
struct Scores {
    Scores(const SearchJob& job, const SearchScratch& s, int index)
        : left_mean(s.left_mean),
          left_inverse(s.left_inverse),
          right_sum(s.right_sum - job.c.first - index),
          right_inverse(s.right_inverse - job.c.first - index),
          best(s.best + size_t(index / kGroup) * s.row_ints),
          right_best(s.right_best - job.c.first - index),
          tag(index),
          is_first(index % kGroup == 0) {}
    HWY_INLINE void Take(int x, VI32 window_sum) const {
        const I32 d;
        const F32 df;
        const VF32 expected = hn::Mul(hn::Load(df, left_mean + x), hn::LoadU(df, right_sum + x));
        const VF32 covariance = hn::Sub(hn::ConvertTo(df, window_sum), expected);
        const VF32 inverse =
            hn::Mul(hn::Load(df, left_inverse + x), hn::LoadU(df, right_inverse + x));
        const VI32 score = hn::BitCast(d, hn::Mul(covariance, inverse));
        const VI32 key = hn::Or(hn::And(score, hn::Set(d, ~0xff)), hn::Set(d, tag));
        hn::Store(hn::Max(is_first ? hn::Zero(d) : hn::Load(d, best + x), key), d, best + x);
        hn::StoreU(hn::Max(hn::LoadU(d, right_best + x), key), d, right_best + x);
    }

    const float *left_mean, *left_inverse, *right_sum, *right_inverse;
    int32_t *best, *right_best;
    int tag;
    bool is_first;  // of its group: what is there is of another row
};

// A disparity's columns are brought up to date just before they are used: those of all of them are
// more than the first caches hold. Windows that are not inside score 0.
void ScoreAll(const SearchJob& job, const SearchScratch& s) {
    const I32 d32;
    const int lanes = int(hn::Lanes(d32)), width = job.c.half_width;
    for (int index = 0; index < job.c.count; ++index) {
        if (job.c.first + index + 2 * job.c.radius >= width) break;
        const DisparityColumns columns(job, s, index);
        const Scores scores(job, s, index);
        if (job.c.radius != 4) {
            UpdateColumns(job, s, index);
            for (int x = columns.begin; x < width; x += lanes) {
                const int32_t* column = columns.sums + x;
                VI32 sum = hn::Load(d32, column);
                for (int u = 1; u <= job.c.radius; ++u)
                    sum = hn::Add(sum,
                                  hn::Add(hn::LoadU(d32, column - u), hn::LoadU(d32, column + u)));
                scores.Take(x, sum);
            }
            continue;
        }
        int x = columns.begin;
        const VI32 none = hn::Zero(d32), first = columns.Update(x),
                   second = x + lanes < width ? columns.Update(x + lanes) : none;
        NineColumns windows(first, second);
        for (; x + 2 * lanes < width; x += lanes)
            scores.Take(x, windows.Step(columns.Update(x + 2 * lanes)));
        for (; x < width; x += lanes) scores.Take(x, windows.Step(none));
    }
}

// Keys of score 0 carry only an index.
HWY_INLINE VI32 WithoutZeros(VI32 key) {
    const I32 d32;
    return hn::IfThenElseZero(hn::Gt(key, hn::Set(d32, 255)), key);
}

// Winners of the row and the checks of the left ones.
void CheckRow(const SearchJob& job, const SearchScratch& s, int y) {
    const I32 d32;
    const F32 df;
    const hn::Rebind<int16_t, I32> d16;
    const hn::Rebind<uint8_t, I32> d8;
    const int lanes = int(hn::Lanes(d32)), groups = (job.c.count + kGroup - 1) / kGroup;
    const VI32 index_bits = hn::Set(d32, 255), zero = hn::Zero(d32), one = hn::Set(d32, 1);
    const uint8_t* left_mask = job.left_mask.row(y);
    const uint8_t* right_mask = job.right_mask.row(y);
    for (int x = 0; x < job.c.half_width; x += lanes) {
        const VI32 key = WithoutZeros(hn::Load(d32, s.right_best + x));
        hn::Store(key, d32, s.right_best + x);
        const auto usable = hn::Gt(hn::PromoteTo(d32, hn::LoadU(d8, right_mask + x)), zero);
        hn::Store(hn::IfThenElse(usable, hn::And(key, index_bits), hn::Set(d32, 1 << 20)), d32,
                  s.right_index + x);
    }
    for (int x = 0; x < job.c.half_width; x += lanes) {
        VI32 key = zero;
        for (int g = 0; g < groups; ++g)
            key = hn::Max(key, hn::Load(d32, s.best + size_t(g) * s.row_ints + x));
        key = WithoutZeros(key);
        if (job.left_keys != nullptr) hn::Store(key, d32, s.keys + x);
        const VI32 index = hn::And(key, index_bits), group = hn::ShiftRight<2>(index);
        VI32 second = zero;
        for (int g = 0; g < groups; ++g) {
            const auto far = hn::Gt(hn::Abs(hn::Sub(group, hn::Set(d32, g))), one);
            second = hn::Max(second, hn::IfThenElseZero(
                                         far, hn::Load(d32, s.best + size_t(g) * s.row_ints + x)));
        }
        const VI32 score_bits = hn::Set(d32, ~0xff);
        const VF32 score = hn::BitCast(df, hn::And(key, score_bits));
        const VF32 lead =
            hn::Sub(score, hn::BitCast(df, hn::And(WithoutZeros(second), score_bits)));
        const auto strong = hn::And(hn::Ge(score, hn::Set(df, job.c.min_score)),
                                    hn::Ge(lead, hn::Set(df, job.c.min_lead)));
        const VI32 disparity = hn::Add(index, hn::Set(d32, job.c.first));
        const VI32 back = hn::GatherIndex(d32, s.right_index, hn::Sub(Columns(x), disparity));
        auto good = hn::And(hn::Gt(key, zero), hn::RebindMask(d32, strong));
        good = hn::And(good,
                       hn::Lt(hn::Abs(hn::Sub(back, index)), hn::Set(d32, job.c.left_right + 1)));
        good = hn::And(
            good, hn::Gt(hn::Load(d32, s.left_variance + x), hn::Set(d32, job.c.min_variance - 1)));
        good = hn::And(good, hn::Gt(hn::PromoteTo(d32, hn::LoadU(d8, left_mask + x)), zero));
        const VI32 result =
            hn::IfThenElse(good, hn::ShiftLeft<4>(disparity), hn::Set(d32, kNoDisparity));
        hn::StoreU(hn::DemoteTo(d16, result), d16, job.checked.row(y) + x);
    }
    std::fill_n(job.checked.row(y) + job.c.half_width, kMargin, int16_t(kNoDisparity));
    const size_t bytes = size_t(job.c.half_width) * sizeof(int32_t);
    if (job.left_keys != nullptr)
        std::memcpy(job.left_keys + size_t(y) * size_t(job.c.half_width), s.keys, bytes);
    if (job.right_keys != nullptr)
        std::memcpy(job.right_keys + size_t(y) * size_t(job.c.half_width), s.right_best, bytes);
}

void EmptyRow(const SearchJob& job, int y) {
    const size_t bytes = size_t(job.c.half_width) * sizeof(int32_t);
    std::fill_n(job.checked.row(y), job.c.half_width + kMargin, int16_t(kNoDisparity));
    if (job.left_keys != nullptr)
        std::memset(job.left_keys + size_t(y) * size_t(job.c.half_width), 0, bytes);
    if (job.right_keys != nullptr)
        std::memset(job.right_keys + size_t(y) * size_t(job.c.half_width), 0, bytes);
}

// Moves the window on so that it is centred on row y, but for the products of the last two rows,
// whose pairs it leaves for ScoreAll; the first time it gathers the whole window.
void MoveWindow(const SearchJob& job, const SearchScratch& s, int y, bool first) {
    const int r = job.c.radius;
    const auto make_pairs = [&](int a, int b, int sign) {
        const auto row = [](Plane<const uint8_t> image, int v) {
            return v < 0 ? nullptr : image.row(v);
        };
        MakePairs(row(job.left, a), row(job.left, b), 1, job.c.half_width, s.left_pairs);
        MakePairs(row(job.right, a), row(job.right, b), sign, job.c.half_width, s.right_pairs);
    };
    if (first) {
        for (int v = y - r; v < y + r; v += 2) {
            make_pairs(v, v + 1, 1);
            for (int index = 0; index < job.c.count; ++index) UpdateColumns(job, s, index);
        }
        make_pairs(y + r, -1, 1);
        for (int v = y - r; v <= y + r; ++v) {
            UpdateColumnSums(job.left.row(v), nullptr, job.c.half_width, s.left_sums,
                             s.left_squares);
            UpdateColumnSums(job.right.row(v), nullptr, job.c.half_width, s.right_sums,
                             s.right_squares);
        }
        return;
    }
    const int enter = y + r, leave = y - r - 1;
    make_pairs(enter, leave, -1);
    UpdateColumnSums(job.left.row(enter), job.left.row(leave), job.c.half_width, s.left_sums,
                     s.left_squares);
    UpdateColumnSums(job.right.row(enter), job.right.row(leave), job.c.half_width, s.right_sums,
                     s.right_squares);
}

void SearchRows(const SearchJob& job, int y0, int y1, int32_t* memory) {
    std::memset(memory, 0, SearchScratch::Total(job.c) * sizeof(int32_t));
    const SearchScratch s(job, memory);
    bool first = true;
    for (int y = y0; y < y1; ++y) {
        if (y < job.c.radius || y >= job.c.half_height - job.c.radius) {
            EmptyRow(job, y);
            continue;
        }
        MoveWindow(job, s, y, first);
        first = false;
        RowStatistics(job, s);
        std::memset(s.right_best, 0, s.row_ints * sizeof(int32_t));
        ScoreAll(job, s);
        CheckRow(job, s, y);
    }
}

size_t SearchScratchInts(const StereoConstants& c) { return SearchScratch::Total(c); }

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(SearchRows);
HWY_EXPORT(SearchScratchInts);

size_t search_scratch_ints(const StereoConstants& c) {
    return HWY_DYNAMIC_DISPATCH(SearchScratchInts)(c);
}
void search_rows(const SearchJob& job, int y0, int y1, int32_t* scratch) {
    HWY_DYNAMIC_DISPATCH(SearchRows)(job, y0, y1, scratch);
}

}  // namespace defrec::cpu
#endif
