// The search of stereo at the samples of half resolution: window sums, correlation, winners,
// checks. Lanes are samples of a row, so even and odd columns lie apart; the products of a column
// of the window are kept for each disparity and updated from row to row, the scores are never
// stored.
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

// Elements of the even and of the odd columns of a row.
struct Columns2 {
    int32_t *even, *odd;
};
struct Floats2 {
    float *even, *odd;
};

// Where the parts of the scratch memory lie. Rows have kMargin zeros on both sides; those of the
// right image enough for every x - d.
struct SearchScratch {
    SearchScratch(const SearchJob& job, int32_t* memory) {
        const size_t row = RowInts(job.c), reach = ReachInts(job.c);
        const auto take = [&](size_t before, size_t count) {
            int32_t* part = memory + before;
            memory += before + count;
            return part;
        };
        const auto take_two = [&](size_t before) {
            int32_t* even = take(before, row);
            return Columns2{even, take(before, row)};
        };
        const auto take_floats = [&](size_t before) {
            const Columns2 both = take_two(before);
            return Floats2{reinterpret_cast<float*>(both.even), reinterpret_cast<float*>(both.odd)};
        };
        row_ints = row;
        right_distance = ptrdiff_t(reach + row);
        columns = take(kMargin, 2 * row * size_t(job.c.count));
        best = take(kMargin, row * size_t((job.c.count + kGroup - 1) / kGroup));
        keys = take(kMargin, row);
        left_variance = take(kMargin, row);
        left_mean = reinterpret_cast<float*>(take(kMargin, row));
        left_inverse = reinterpret_cast<float*>(take(kMargin, row));
        for (Columns2* part :
             {&left_enter, &left_leave, &left_sums, &left_squares, &right_sums, &right_squares})
            *part = take_two(kMargin);
        for (Columns2* part : {&right_enter, &right_leave, &right_best, &right_index})
            *part = take_two(reach);
        right_sum = take_floats(reach);
        right_inverse = take_floats(reach);
    }
    // A row's elements up to the next row's: the margin of one is that of the next.
    static size_t RowInts(const StereoConstants& c) {
        return (size_t(c.half_samples_x) + 15) / 16 * 16 + kMargin;
    }
    static size_t ReachInts(const StereoConstants& c) {
        return (size_t(c.first + c.count) / 2 + 16) / 16 * 16 + kMargin;
    }
    static size_t Total(const StereoConstants& c) {
        const size_t parts = 2 * size_t(c.count) + size_t((c.count + kGroup - 1) / kGroup) + 28;
        return parts * RowInts(c) + 18 * size_t{kMargin} + 12 * ReachInts(c);
    }

    size_t row_ints;
    ptrdiff_t right_distance;  // of the odd columns' elements from the even ones', right image
    int32_t *columns, *best, *keys, *left_variance;
    float *left_mean, *left_inverse;
    // Pairs of pixels of two rows above each other that enter and leave the window.
    Columns2 left_enter, left_leave, right_enter, right_leave;
    Columns2 left_sums, left_squares, right_sums, right_squares;  // over the columns of the window
    Columns2 right_best, right_index;
    Floats2 right_sum, right_inverse;
};

// work(parity, elements) for the even and the odd columns of a row.
template <class Work>
HWY_INLINE void ForBoth(int width, Work&& work) {
    work(0, (width + 1) / 2);
    work(1, width / 2);
}

// Pairs of centred values of two rows, both times sign; a null row is zeros.
void MakePairs(const uint8_t* first, const uint8_t* second, int sign, int width, Columns2 pairs) {
    ForBoth(width, [&](int parity, int count) {
        int32_t* HWY_RESTRICT to = parity == 0 ? pairs.even : pairs.odd;
        for (int i = 0; i < count; ++i) {
            const int a = first != nullptr ? sign * (first[2 * i + parity] - 128) : 0,
                      b = second != nullptr ? sign * (second[2 * i + parity] - 128) : 0;
            to[i] = (a & 0xffff) | int32_t(uint32_t(b) << 16);
        }
    });
}

void AddColumns(const uint8_t* row, int sign, int width, Columns2 sums, Columns2 squares) {
    ForBoth(width, [&](int parity, int count) {
        int32_t* HWY_RESTRICT sum = parity == 0 ? sums.even : sums.odd;
        int32_t* HWY_RESTRICT square = parity == 0 ? squares.even : squares.odd;
        for (int i = 0; i < count; ++i) {
            const int a = row[2 * i + parity] - 128;
            sum[i] += sign * a;
            square[i] += sign * a * a;
        }
    });
}

// What a sample's row of a disparity reads of the right image: of even disparities the columns of
// the same parity, of odd ones those of the other.
HWY_INLINE int32_t* RightAtEven(Columns2 right, int d) {
    return d % 2 == 0 ? right.even - d / 2 : right.odd - d / 2 - 1;
}
HWY_INLINE int32_t* RightAtOdd(Columns2 right, int d) {
    return (d % 2 == 0 ? right.odd : right.even) - d / 2;
}
HWY_INLINE const float* RightAtEven(Floats2 right, int d) {
    return d % 2 == 0 ? right.even - d / 2 : right.odd - d / 2 - 1;
}

// The columns of a disparity, from where the first has a right pixel.
struct DisparityColumns {
    DisparityColumns(const SearchJob& job, const SearchScratch& s, int index) {
        const int d = job.c.first + index, lanes = int(hn::Lanes(I32()));
        begin = d / 2 / lanes * lanes;
        left_enter = s.left_enter;
        left_leave = s.left_leave;
        right_enter = {RightAtEven(s.right_enter, d), RightAtOdd(s.right_enter, d)};
        right_leave = {RightAtEven(s.right_leave, d), RightAtOdd(s.right_leave, d)};
        sums.even = s.columns + 2 * size_t(index) * s.row_ints;
        sums.odd = sums.even + s.row_ints;
    }
    // With the products of the pairs added.
    HWY_INLINE VI32 Even(int i) const {
        return Update(i, left_enter.even, left_leave.even, right_enter.even, right_leave.even,
                      sums.even);
    }
    HWY_INLINE VI32 Odd(int i) const {
        return Update(i, left_enter.odd, left_leave.odd, right_enter.odd, right_leave.odd,
                      sums.odd);
    }
    static HWY_INLINE VI32 Update(int i, const int32_t* left_in, const int32_t* left_out,
                                  const int32_t* right_in, const int32_t* right_out, int32_t* to) {
        const I32 d;
        const VI32 products =
            hn::Add(PairProducts(hn::Load(d, left_in + i), hn::LoadU(d, right_in + i)),
                    PairProducts(hn::Load(d, left_out + i), hn::LoadU(d, right_out + i)));
        const VI32 sum = hn::Add(hn::Load(d, to + i), products);
        hn::Store(sum, d, to + i);
        return sum;
    }

    int begin;
    Columns2 left_enter, left_leave, right_enter, right_leave, sums;
};

HWY_INLINE void UpdateColumns(const SearchJob& job, const SearchScratch& s, int index) {
    const DisparityColumns columns(job, s, index);
    for (int i = columns.begin; i < job.c.half_samples_x; i += int(hn::Lanes(I32()))) {
        columns.Even(i);
        columns.Odd(i);
    }
}

// The sum over the window's columns round those of one parity; other: those of the other one.
HWY_INLINE VI32 WindowSum(const int32_t* own, const int32_t* other, int parity, int i, int radius) {
    const I32 d;
    const int reach = (radius + 1) / 2;
    VI32 sum = hn::Load(d, own + i);
    for (int k = 1; k <= radius / 2; ++k)
        sum = hn::Add(sum, hn::Add(hn::LoadU(d, own + i - k), hn::LoadU(d, own + i + k)));
    for (int k = parity - reach; k < parity + reach; ++k)
        sum = hn::Add(sum, hn::LoadU(d, other + i + k));
    return sum;
}

struct WindowLanes {
    VI32 sum, variance;  // n^2 times the variance
    VF32 inverse;        // its inverse root
};

// The windows round a row's columns of one parity; all 0 where a window is not inside.
HWY_INLINE WindowLanes WindowStatistics(Columns2 sums, Columns2 squares, int parity, int i,
                                        int radius, int width) {
    const I32 d32;
    const auto window = [&](Columns2 of) HWY_ATTR {
        return parity == 0 ? WindowSum(of.even, of.odd, 0, i, radius)
                           : WindowSum(of.odd, of.even, 1, i, radius);
    };
    const VI32 total = window(sums), square = window(squares);
    const VI32 column = hn::Add(hn::Add(Columns(i), Columns(i)), hn::Set(d32, parity));
    const auto inside = hn::And(hn::Gt(column, hn::Set(d32, radius - 1)),
                                hn::Lt(column, hn::Set(d32, width - radius)));
    const int n = (2 * radius + 1) * (2 * radius + 1);
    const VI32 variance = hn::IfThenElseZero(
        inside, hn::Sub(hn::Mul(hn::Set(d32, n), square), hn::Mul(total, total)));
    return {hn::IfThenElseZero(inside, total), variance, InverseRoot(variance)};
}

void RowStatistics(const SearchJob& job, const SearchScratch& s) {
    const I32 d32;
    const F32 df;
    const int radius = job.c.radius, width = job.c.half_width;
    for (int i = 0; i < job.c.half_samples_x; i += int(hn::Lanes(d32))) {
        const WindowLanes left = WindowStatistics(s.left_sums, s.left_squares, 0, i, radius, width);
        hn::Store(left.variance, d32, s.left_variance + i);
        hn::Store(left.inverse, df, s.left_inverse + i);
        hn::Store(hn::Mul(hn::ConvertTo(df, left.sum), hn::Set(df, job.c.one_over_n)), df,
                  s.left_mean + i);
        for (int parity = 0; parity < 2; ++parity) {
            const WindowLanes right =
                WindowStatistics(s.right_sums, s.right_squares, parity, i, radius, width);
            hn::Store(right.inverse, df,
                      (parity == 0 ? s.right_inverse.even : s.right_inverse.odd) + i);
            hn::Store(hn::ConvertTo(df, right.sum), df,
                      (parity == 0 ? s.right_sum.even : s.right_sum.odd) + i);
        }
    }
}

// Scores of one disparity from sums over windows, into the best of its group and of the right
// pixels.
struct Scores {
    Scores(const SearchJob& job, const SearchScratch& s, int index)
        : left_mean(s.left_mean),
          left_inverse(s.left_inverse),
          right_sum(RightAtEven(s.right_sum, job.c.first + index)),
          right_inverse(RightAtEven(s.right_inverse, job.c.first + index)),
          best(s.best + size_t(index / kGroup) * s.row_ints),
          right_best(RightAtEven(s.right_best, job.c.first + index)),
          tag(index),
          is_first(index % kGroup == 0) {}
    HWY_INLINE void Take(int i, VI32 window_sum) const {
        const I32 d;
        const F32 df;
        const VF32 expected = hn::Mul(hn::Load(df, left_mean + i), hn::LoadU(df, right_sum + i));
        const VF32 covariance = hn::Sub(hn::ConvertTo(df, window_sum), expected);
        const VF32 inverse =
            hn::Mul(hn::Load(df, left_inverse + i), hn::LoadU(df, right_inverse + i));
        const VI32 score = hn::BitCast(d, hn::Mul(covariance, inverse));
        const VI32 key = hn::Or(hn::And(score, hn::Set(d, ~0xff)), hn::Set(d, tag));
        hn::Store(hn::Max(is_first ? hn::Zero(d) : hn::Load(d, best + i), key), d, best + i);
        hn::StoreU(hn::Max(hn::LoadU(d, right_best + i), key), d, right_best + i);
    }

    const float *left_mean, *left_inverse, *right_sum, *right_inverse;
    int32_t *best, *right_best;
    int tag;
    bool is_first;  // of its group: what is there is of another row
};

// A disparity's columns are brought up to date just before they are used: those of all of them are
// more than the first caches hold. Windows that are not inside score 0.
void ScoreAll(const SearchJob& job, const SearchScratch& s) {
    const int lanes = int(hn::Lanes(I32())), samples = job.c.half_samples_x;
    for (int index = 0; index < job.c.count; ++index) {
        if (job.c.first + index + 2 * job.c.radius >= job.c.half_width) break;
        const DisparityColumns columns(job, s, index);
        const Scores scores(job, s, index);
        if (job.c.radius != 4) {
            UpdateColumns(job, s, index);
            for (int i = columns.begin; i < samples; i += lanes)
                scores.Take(i, WindowSum(columns.sums.even, columns.sums.odd, 0, i, job.c.radius));
            continue;
        }
        int i = columns.begin;
        NineColumns windows(columns.Even(i), columns.Odd(i));
        for (; i + lanes < samples; i += lanes)
            scores.Take(i, windows.Step(columns.Even(i + lanes), columns.Odd(i + lanes)));
        scores.Take(i, windows.Step(hn::Zero(I32()), hn::Zero(I32())));
    }
}

// Keys of score 0 carry only an index.
HWY_INLINE VI32 WithoutZeros(VI32 key) {
    const I32 d32;
    return hn::IfThenElseZero(hn::Gt(key, hn::Set(d32, 255)), key);
}

// The winners of the right pixels of the row, and their indices where they are usable.
HWY_INLINE void TakeRightWinners(const SearchJob& job, const SearchScratch& s, int row) {
    const I32 d32;
    const VI32 index_bits = hn::Set(d32, 255), zero = hn::Zero(d32);
    const uint8_t* right_mask = job.right_mask.row(2 * row);
    for (int i = 0; i < job.c.half_samples_x; i += int(hn::Lanes(d32))) {
        const VI32 masks = BytePairs(right_mask + 2 * i);
        const auto take = [&](int32_t* best, int32_t* index, VI32 mask) HWY_ATTR {
            const VI32 key = WithoutZeros(hn::Load(d32, best + i));
            hn::Store(key, d32, best + i);
            hn::Store(
                hn::IfThenElse(hn::Gt(mask, zero), hn::And(key, index_bits), hn::Set(d32, 1 << 20)),
                d32, index + i);
        };
        take(s.right_best.even, s.right_index.even, hn::And(masks, index_bits));
        take(s.right_best.odd, s.right_index.odd, hn::ShiftRight<8>(masks));
    }
}

// The keys of the row's winners, where the job wants them.
HWY_INLINE void GiveKeys(const SearchJob& job, const SearchScratch& s, int row) {
    const size_t samples = size_t(job.c.half_samples_x);
    if (job.left_keys != nullptr)
        std::copy_n(s.keys, samples, job.left_keys + size_t(row) * samples);
    if (job.right_keys == nullptr) return;
    int32_t* keys = job.right_keys + size_t(row) * size_t(job.c.half_width);
    ForBoth(job.c.half_width, [&](int parity, int count) {
        const int32_t* from = parity == 0 ? s.right_best.even : s.right_best.odd;
        for (int i = 0; i < count; ++i) keys[2 * i + parity] = from[i];
    });
}

// Winners of the row and the checks of the left ones.
void CheckRow(const SearchJob& job, const SearchScratch& s, int row) {
    const I32 d32;
    const F32 df;
    const hn::Rebind<int16_t, I32> d16;
    const int lanes = int(hn::Lanes(d32)), samples = job.c.half_samples_x,
              groups = (job.c.count + kGroup - 1) / kGroup;
    const VI32 index_bits = hn::Set(d32, 255), zero = hn::Zero(d32), one = hn::Set(d32, 1);
    const uint8_t* left_mask = job.left_mask.row(2 * row);
    TakeRightWinners(job, s, row);
    for (int i = 0; i < samples; i += lanes) {
        VI32 key = zero;
        for (int g = 0; g < groups; ++g)
            key = hn::Max(key, hn::Load(d32, s.best + size_t(g) * s.row_ints + i));
        key = WithoutZeros(key);
        if (job.left_keys != nullptr) hn::Store(key, d32, s.keys + i);
        const VI32 index = hn::And(key, index_bits), group = hn::ShiftRight<2>(index);
        VI32 second = zero;
        for (int g = 0; g < groups; ++g) {
            const auto far = hn::Gt(hn::Abs(hn::Sub(group, hn::Set(d32, g))), one);
            second = hn::Max(second, hn::IfThenElseZero(
                                         far, hn::Load(d32, s.best + size_t(g) * s.row_ints + i)));
        }
        const VI32 score_bits = hn::Set(d32, ~0xff);
        const VF32 score = hn::BitCast(df, hn::And(key, score_bits));
        const VF32 lead =
            hn::Sub(score, hn::BitCast(df, hn::And(WithoutZeros(second), score_bits)));
        const auto strong = hn::And(hn::Ge(score, hn::Set(df, job.c.min_score)),
                                    hn::Ge(lead, hn::Set(df, job.c.min_lead)));
        const VI32 disparity = hn::Add(index, hn::Set(d32, job.c.first)),
                   column = hn::Add(Columns(i), Columns(i)),
                   parity_offset = hn::And(hn::Neg(hn::And(disparity, one)),
                                           hn::Set(d32, int(s.right_distance)));
        const VI32 back =
            hn::GatherIndex(d32, s.right_index.even,
                            hn::Add(hn::ShiftRight<1>(hn::Sub(column, disparity)), parity_offset));
        auto good = hn::And(hn::Gt(key, zero), hn::RebindMask(d32, strong));
        good = hn::And(good,
                       hn::Lt(hn::Abs(hn::Sub(back, index)), hn::Set(d32, job.c.left_right + 1)));
        good = hn::And(
            good, hn::Gt(hn::Load(d32, s.left_variance + i), hn::Set(d32, job.c.min_variance - 1)));
        good = hn::And(good, hn::Gt(hn::And(BytePairs(left_mask + 2 * i), index_bits), zero));
        const VI32 result =
            hn::IfThenElse(good, hn::ShiftLeft<4>(disparity), hn::Set(d32, kNoDisparity));
        hn::StoreU(hn::DemoteTo(d16, result), d16, job.checked.row(row) + i);
    }
    std::fill_n(job.checked.row(row) + samples, kMargin, int16_t(kNoDisparity));
    GiveKeys(job, s, row);
}

void EmptyRow(const SearchJob& job, int row) {
    const size_t samples = size_t(job.c.half_samples_x), width = size_t(job.c.half_width);
    std::fill_n(job.checked.row(row), samples + kMargin, int16_t(kNoDisparity));
    if (job.left_keys != nullptr)
        std::fill_n(job.left_keys + size_t(row) * samples, samples, int32_t{0});
    if (job.right_keys != nullptr)
        std::fill_n(job.right_keys + size_t(row) * width, width, int32_t{0});
}

// Moves the window on by two rows so that it is centred on row y, but for the products of the rows
// that enter and leave, whose pairs it leaves for ScoreAll; the first time it gathers the whole
// window.
void MoveWindow(const SearchJob& job, const SearchScratch& s, int y, bool first) {
    const int r = job.c.radius, width = job.c.half_width;
    const auto row = [](Plane<const uint8_t> image, int v) {
        return v < 0 ? nullptr : image.row(v);
    };
    const auto let_enter = [&](int a, int b) {
        MakePairs(row(job.left, a), row(job.left, b), 1, width, s.left_enter);
        MakePairs(row(job.right, a), row(job.right, b), 1, width, s.right_enter);
    };
    const auto add_row = [&](int v, int sign) {
        AddColumns(job.left.row(v), sign, width, s.left_sums, s.left_squares);
        AddColumns(job.right.row(v), sign, width, s.right_sums, s.right_squares);
    };
    if (first) {
        for (int v = y - r; v < y + r; v += 2) {
            let_enter(v, v + 1);
            for (int index = 0; index < job.c.count; ++index) UpdateColumns(job, s, index);
        }
        let_enter(y + r, -1);
        for (int v = y - r; v <= y + r; ++v) add_row(v, 1);
        return;
    }
    let_enter(y + r - 1, y + r);
    const int leave = y - r - 2;
    MakePairs(job.left.row(leave), job.left.row(leave + 1), 1, width, s.left_leave);
    MakePairs(job.right.row(leave), job.right.row(leave + 1), -1, width, s.right_leave);
    for (const int v : {y + r - 1, y + r}) add_row(v, 1);
    for (const int v : {leave, leave + 1}) add_row(v, -1);
}

void SearchRows(const SearchJob& job, int row0, int row1, int32_t* memory) {
    std::memset(memory, 0, SearchScratch::Total(job.c) * sizeof(int32_t));
    const SearchScratch s(job, memory);
    bool first = true;
    for (int row = row0; row < row1; ++row) {
        const int y = 2 * row;
        if (y < job.c.radius || y >= job.c.half_height - job.c.radius) {
            EmptyRow(job, row);
            continue;
        }
        MoveWindow(job, s, y, first);
        first = false;
        RowStatistics(job, s);
        std::memset(s.right_best.even, 0, s.row_ints * sizeof(int32_t));
        std::memset(s.right_best.odd, 0, s.row_ints * sizeof(int32_t));
        ScoreAll(job, s);
        CheckRow(job, s, row);
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
void search_rows(const SearchJob& job, int row0, int row1, int32_t* scratch) {
    HWY_DYNAMIC_DISPATCH(SearchRows)(job, row0, row1, scratch);
}

}  // namespace defrec::cpu
#endif
