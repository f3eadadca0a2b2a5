// Sampling a patch from its view, and its ZNCC over the search window: lanes are every
// second displacement along x.
#include <algorithm>
#include <cstring>
#include <type_traits>

#include "backends/cpu/align_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/align_search.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

#include "backends/cpu/align_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace {
using namespace align;

using D32 = hn::CappedTag<int32_t, 16>;
constexpr int32_t kHalfLanes = 8;
using DHalf = hn::CappedTag<int32_t, kHalfLanes>;
using D16 = hn::Repartition<int16_t, D32>;
using DFloat = hn::RebindToFloat<D32>;
using V32 = hn::Vec<D32>;
using VFloat = hn::Vec<DFloat>;

// Samples of a patch, with room behind it for vectors.
constexpr int32_t kMaxSamples = (kAlignRows + 2) * (kAlignRows + 2) + 2 * kAlignLanes;

// x, x + 1, ... Highway's Iota of a variable goes through memory, lane by lane.
template <class D, class T = hn::TFromD<D>>
hn::Vec<D> columns_from(D d, int32_t x) {
    return hn::Add(hn::Iota(d, 0), hn::Set(d, T(x)));
}

// Sum of the products of two rows' halves.
template <class V>
V multiply_pairs(V a, V b, V sum, V& rest) {
    const hn::DFromV<V> d;
    const hn::Repartition<int16_t, decltype(d)> halves;
    return hn::ReorderWidenMulAccumulate(d, hn::BitCast(halves, a), hn::BitCast(halves, b), sum,
                                         rest);
}
V32 multiply_pairs(V32 a, V32 b) {
    V32 rest = hn::Zero(D32());
    const V32 sum = multiply_pairs(a, b, hn::Zero(D32()), rest);
    return hn::RearrangeToOddPlusEven(sum, rest);
}

// The patch and one pixel round it, row by row, 1/16 gray level; false where it leaves the view.
bool sample_view(const AlignRun& run, const AlignCentre& centre, const int32_t m[4],
                 int32_t fraction_x, int32_t fraction_y, int16_t* out) {
    const AlignView& view = run.views[centre.view];
    const AlignPlaces& places = *run.places;
    const int32_t reach = int32_t(run.params->patch_radius) + 1;
    const auto at = [centre, m](int axis, int32_t dx, int32_t dy) {
        return 256 * (axis == 0 ? centre.x : centre.y) +
               ((m[2 * axis] * dx + m[2 * axis + 1] * dy + 128) >> 8);
    };
    // Positions grow or fall along rows and columns, so the corners are the extremes.
    for (const int32_t oy : {-reach, reach})
        for (const int32_t ox : {-reach, reach}) {
            const int32_t dx = kPatchOne * ox - fraction_x, dy = kPatchOne * oy - fraction_y;
            const int32_t x0 = at(0, dx, dy) >> 15, y0 = at(1, dx, dy) >> 15;
            if (x0 < 0 || y0 < 0 || x0 + 1 >= view.width || y0 + 1 >= view.height) return false;
        }
    const D32 d;
    const hn::Rebind<int16_t, D32> narrow;
    const hn::Repartition<uint8_t, D32> bytes;
    const auto byte = hn::Set(d, 255);
    // Whole pixels from the centre move positions by whole units.
    const auto position = [&](int axis, V32 across, V32 down) HWY_ATTR {
        return hn::Add(hn::Set(d, at(axis, -fraction_x, -fraction_y)),
                       hn::Add(hn::Mul(hn::Set(d, m[2 * axis]), across),
                               hn::Mul(hn::Set(d, m[2 * axis + 1]), down)));
    };
    // The first two of a lane's four bytes in 16 bits each.
    alignas(16) static constexpr uint8_t kFirstTwo[16] = {0, 128, 1, 128, 4,  128, 5,  128,
                                                          8, 128, 9, 128, 12, 128, 13, 128};
    const auto first_two = hn::LoadDup128(bytes, kFirstTwo);
    const int32_t count = (2 * reach + 1) * (2 * reach + 1);
    for (int32_t k = 0; k < count; k += int32_t(hn::Lanes(d))) {
        const V32 across = hn::LoadU(d, &places.sample_x[size_t(k)]),
                  down = hn::LoadU(d, &places.sample_y[size_t(k)]);
        const V32 x = position(0, across, down), y = position(1, across, down);
        const V32 fx = hn::And(hn::ShiftRight<7>(x), byte),
                  fy = hn::And(hn::ShiftRight<7>(y), byte);
        const V32 offset =
            hn::Add(hn::Mul(hn::ShiftRight<15>(y), hn::Set(d, view.width)), hn::ShiftRight<15>(x));
        const V32 weights = hn::Or(hn::Sub(hn::Set(d, 256), fx), hn::ShiftLeft<16>(fx));
        // Two pixels of a row, of the four bytes from the left one on.
        const auto blend = [&](const uint8_t* pixels) HWY_ATTR {
            const V32 four = hn::GatherOffset(d, reinterpret_cast<const int32_t*>(pixels), offset);
            const auto pair = hn::TableLookupBytesOr0(hn::BitCast(bytes, four), first_two);
            return multiply_pairs(hn::BitCast(d, pair), weights);
        };
        const V32 top = blend(view.pixels), bottom = blend(view.pixels + view.width);
        const V32 value = hn::Add(hn::ShiftLeft<8>(top), hn::Mul(hn::Sub(bottom, top), fy));
        hn::StoreU(hn::DemoteTo(narrow, hn::ShiftRight<12>(hn::Add(value, hn::Set(d, 2048)))),
                   narrow, out + k);
    }
    return true;
}

// Template and gradient into the scratch; false without texture.
bool prepare_template(const int16_t* sampled, const defrec_align_params& params,
                      AlignScratch& scratch) {
    const DRow d;
    const hn::Repartition<int32_t, DRow> wide;
    const int32_t r = int32_t(params.patch_radius), side = 2 * r + 1, n = side * side,
                  stride = side + 2, lanes = int32_t(hn::Lanes(d));
    const auto one = hn::Set(d, 1);
    const auto inside = [side](int32_t column) HWY_ATTR {
        return hn::Lt(columns_from(DRow(), column), hn::Set(DRow(), int16_t(side)));
    };
    auto sums = hn::Zero(wide), rest = sums;
    for (int32_t column = 0; column < kAlignRow; column += lanes)
        for (int32_t row = 0; row < side; ++row) {
            const auto value = hn::LoadU(d, sampled + (row + 1) * stride + column + 1);
            sums = hn::ReorderWidenMulAccumulate(wide, hn::IfThenElseZero(inside(column), value),
                                                 one, sums, rest);
        }
    const int32_t sum = hn::GetLane(hn::SumOfLanes(wide, hn::Add(sums, rest)));
    const int16_t mean = int16_t((2 * sum + n) / (2 * n));
    auto squares = hn::Zero(wide);
    rest = squares;
    for (int32_t column = 0; column < kAlignRow; column += lanes)
        for (int32_t row = 0; row < side; ++row) {
            const int16_t* from = sampled + (row + 1) * stride + column + 1;
            const auto store = [&](hn::Vec<DRow> value, int16_t* to) HWY_ATTR {
                value = hn::IfThenElseZero(inside(column), value);
                hn::StoreU(value, d, to + row * kAlignRow + column);
                return value;
            };
            const auto half = [&](const int16_t* high, const int16_t* low) HWY_ATTR {
                return hn::ShiftRight<1>(
                    hn::Add(hn::Sub(hn::LoadU(d, high), hn::LoadU(d, low)), one));
            };
            const auto t = store(hn::Sub(hn::LoadU(d, from), hn::Set(d, mean)), scratch.t);
            squares = hn::ReorderWidenMulAccumulate(wide, t, t, squares, rest);
            store(half(from + 1, from - 1), scratch.gx);
            store(half(from + stride, from - stride), scratch.gy);
        }
    const int32_t t = sum - n * mean,
                  tt = hn::GetLane(hn::SumOfLanes(wide, hn::Add(squares, rest)));
    scratch.full_t = t;
    scratch.full_tt = tt;
    return int64_t(n) * tt - int64_t(t) * t >= int64_t(n) * n * params.texture * params.texture;
}

// The lines of an image round (x, y), from `reach` to the left of it on; beyond the image its
// border's. At least kAlignWindowRow bytes of each can be read.
struct Lines {
    const uint8_t* first;
    size_t stride;
    const uint8_t* line(int32_t index) const { return first + size_t(index) * stride; }
};
Lines window_lines(const AlignLevel& level, const uint8_t* image, int32_t x, int32_t y,
                   int32_t reach, uint8_t* buffer) {
    const int32_t left = x - reach, top = y - reach, side = 2 * reach + 1;
    if (left >= 0 && top >= 0 && x + reach < level.width && y + reach < level.height) {
        const size_t first = size_t(top) * level.stride + size_t(left),
                     last = first + size_t(side - 1) * level.stride;
        if (last + kAlignWindowRow <= level.size) return {image + first, level.stride};
    }
    for (int32_t j = 0; j < side; ++j) {
        const uint8_t* row =
            image + size_t(std::clamp(top + j, 0, level.height - 1)) * level.stride;
        for (int32_t k = 0; k < side; ++k)
            buffer[j * kAlignWindowRow + k] = row[std::clamp(left + k, 0, level.width - 1)];
    }
    return {buffer, kAlignWindowRow};
}

// Whether one of the first `side` pixels of as many lines is masked.
bool any_masked(const Lines& mask, int32_t side) {
    const hn::CappedTag<uint8_t, kAlignWindowRow> d;
    auto minimum = hn::Set(d, 255);
    for (int32_t k = 0; k < side; k += int32_t(hn::Lanes(d))) {
        auto column = minimum;
        for (int32_t j = 0; j < side; ++j) column = hn::Min(column, hn::LoadU(d, mask.line(j) + k));
        minimum = hn::IfThenElse(hn::FirstN(d, size_t(side - k)), column, minimum);
    }
    return !hn::AllFalse(d, hn::Eq(minimum, hn::Zero(d)));
}

// The window round (x, y).
void load_window(const AlignLevel& level, int32_t x, int32_t y, int32_t reach,
                 AlignScratch& scratch) {
    const D16 d;
    const hn::Rebind<uint8_t, D16> bytes;
    const int32_t side = 2 * reach + 1, lanes = int32_t(hn::Lanes(d));
    uint8_t buffer[kAlignWindowRows * kAlignWindowRow];
    const Lines gray = window_lines(level, level.gray, x, y, reach, buffer);
    for (int32_t j = 0; j < side; ++j)
        for (int32_t k = 0; k < side; k += lanes)
            hn::StoreU(hn::PromoteTo(d, hn::LoadU(bytes, gray.line(j) + k)), d,
                       scratch.live + j * kAlignWindowRow + k);
    scratch.masked = false;
    if (level.mask == nullptr) return;
    const Lines mask = window_lines(level, level.mask, x, y, reach, buffer);
    scratch.masked = any_masked(mask, side);
    if (!scratch.masked) return;
    for (int32_t j = 0; j < side; ++j)
        for (int32_t k = 0; k < side; k += lanes) {
            const int32_t at = j * kAlignWindowRow + k;
            const auto usable =
                hn::Min(hn::PromoteTo(d, hn::LoadU(bytes, mask.line(j) + k)), hn::Set(d, 1));
            hn::StoreU(usable, d, scratch.usable + at);
            hn::StoreU(hn::Mul(usable, hn::LoadU(d, scratch.live + at)), d,
                       scratch.usable_live + at);
        }
}

// Stores the first count lanes.
template <class V>
void store_first(V value, int32_t count, int32_t* to) {
    const hn::DFromV<V> d;
    if (count >= int32_t(hn::Lanes(d)))
        hn::StoreU(value, d, to);
    else
        hn::BlendedStore(value, hn::FirstN(d, size_t(count)), d, to);
}

// Two pixels in each lane.
template <class D>
hn::Vec<D> load_pairs(D d, const int16_t* from) {
    return hn::BitCast(d, hn::LoadU(hn::Repartition<int16_t, D>(), from));
}

// kRows rows of at most a vector of displacements: the sums of the products of patch and window.
// Unrolled, a vector of the window is loaded once for all rows.
template <int32_t kRows, class D, class Radius>
void correlate_rows(D d, Radius radius, const int16_t* patch, const int16_t* window, int32_t count,
                    int32_t stride, int32_t* out) {
    hn::Vec<D> sum[kRows], rest[kRows];
    for (int32_t j = 0; j < kRows; ++j) sum[j] = rest[j] = hn::Zero(d);
    for (int32_t k = 0; k <= 2 * radius; k += 2) {
        for (int32_t row = 0; row <= 2 * radius; ++row) {
            int32_t two = 0;
            std::memcpy(&two, patch + row * kAlignRow + k, sizeof two);
            const auto pair = hn::Set(d, two);
            for (int32_t j = 0; j < kRows; ++j)
                sum[j] = multiply_pairs(load_pairs(d, window + (row + 2 * j) * kAlignWindowRow + k),
                                        pair, sum[j], rest[j]);
        }
    }
    for (int32_t j = 0; j < kRows; ++j)
        store_first(hn::RearrangeToOddPlusEven(sum[j], rest[j]), count, out + j * stride);
}

// Displacements 2 apart, side x side of them. window: the first one's first pixel.
template <class D, class Radius>
void correlate_all(D d, Radius radius, const int16_t* patch, const int16_t* window, int32_t side,
                   int32_t stride, int32_t* out) {
    constexpr int32_t kMostRows = 5;  // at once
    const int32_t lanes = int32_t(hn::Lanes(d));
    for (int32_t x = 0; x < side; x += lanes) {
        const int32_t count = std::min(lanes, side - x);
        // In parts that are about equal: of 3 to 5 rows, but for a single one.
        const int32_t parts = (side + kMostRows - 1) / kMostRows;
        for (int32_t part = 0; part < parts; ++part) {
            const int32_t dy = side * part / parts, rows = side * (part + 1) / parts - dy;
            const int16_t* from = window + 2 * (dy * kAlignWindowRow + x);
            int32_t* to = out + dy * stride + x;
            switch (rows) {
                case 4:
                    correlate_rows<4>(d, radius, patch, from, count, stride, to);
                    break;
                case 5:
                    correlate_rows<5>(d, radius, patch, from, count, stride, to);
                    break;
                default:
                    correlate_rows<3>(d, radius, patch, from, count, stride, to);
                    break;
            }
        }
    }
}

// The displacements that are scored first. window: the first pixel of the one that is 0.
template <class Radius>
void correlate(Radius radius, const int16_t* patch, const int16_t* window,
               const AlignSearch& search, AlignSums& out) {
    for (const int32_t reach : {search.even, search.odd}) {
        if (reach < 0) continue;
        const int16_t* first = window - reach * (kAlignWindowRow + 1);
        const int32_t side = reach + 1, stride = 2 / search.step * search.row_places;
        int32_t* to = out + search.place(-reach, -reach);
        // Vectors of half the length run on more of a processor's ports.
        // NOLINTNEXTLINE(bugprone-branch-clone): one type where vectors are short
        if (side <= kHalfLanes)
            correlate_all(DHalf(), radius, patch, first, side, stride, to);
        else
            correlate_all(D32(), radius, patch, first, side, stride, to);
    }
}

// Sums of columns of the window, and of their squares where wanted: of two columns together in each
// lane, and of the first of them alone.
template <bool kSquares>
struct ColumnSums {
    V32 both, first, both_squares, first_squares;

    ColumnSums() : both(hn::Zero(D32())), first(both), both_squares(both), first_squares(both) {}
    // Adds or subtracts a row.
    template <class Combine>
    HWY_INLINE void take(const int16_t* row, Combine combine) {
        const V32 pair = load_pairs(D32(), row), left = hn::And(pair, hn::Set(D32(), 0xffff));
        both = combine(both, multiply_pairs(pair, hn::BitCast(D32(), hn::Set(D16(), 1))));
        first = combine(first, left);
        if (!kSquares) return;
        both_squares = combine(both_squares, multiply_pairs(pair, pair));
        first_squares = combine(first_squares, multiply_pairs(left, left));
    }
};

// Sums of the window's pixels, and of their squares where wanted, under the patch at the
// displacements that are scored first: down columns first, which all rows of dy share.
template <bool kSquares, class Radius>
void box_sums(Radius radius, const int16_t* window, const AlignSearch& search, AlignSums& out,
              AlignSums& out_squares) {
    const D32 d;
    constexpr int32_t kLanes = hn::MaxLanes(D32()), kPairs = kAlignWindowRow / 2;
    // The first column is that of an even displacement.
    const int32_t left = (search.top + 1) / 2 * 2, columns = (left + search.top) / 2 + radius + 1;
    const int16_t* corner = window - search.top * kAlignWindowRow - left;
    alignas(64) int32_t both[2][kPairs + kAlignLanes], first[2][kPairs + kAlignLanes];
    ColumnSums<kSquares> sums[kPairs / kLanes];
    const auto add = [](V32 a, V32 b) HWY_ATTR { return hn::Add(a, b); };
    const auto subtract = [](V32 a, V32 b) HWY_ATTR { return hn::Sub(a, b); };
    for (int32_t dy = -search.top, row = 0; dy <= search.top; dy += search.step) {
        const int32_t end = dy + search.top + 2 * radius + 1;
        for (int32_t x = 0, i = 0; x < columns; x += kLanes, ++i) {
            ColumnSums<kSquares> sum = sums[i];
            const int16_t* line = corner + 2 * x;
            for (int32_t k = row; k < end; ++k) sum.take(line + k * kAlignWindowRow, add);
            for (int32_t k = row - 2 * radius - 1; k < end - 2 * radius - 1; ++k)
                if (k >= 0) sum.take(line + k * kAlignWindowRow, subtract);
            sums[i] = sum;
            hn::Store(sum.both, d, both[0] + x);
            hn::Store(sum.first, d, first[0] + x);
            if (!kSquares) continue;
            hn::Store(sum.both_squares, d, both[1] + x);
            hn::Store(sum.first_squares, d, first[1] + x);
        }
        row = end;
        const int32_t reach = search.farthest(dy), from = (left - reach) / 2;
        const auto store = [&](const int32_t* two, const int32_t* one, AlignSums& to) HWY_ATTR {
            for (int32_t x = 0; x <= reach; x += kLanes) {
                const int32_t at = from + x;
                V32 sum = hn::LoadU(d, two + at);
                for (int32_t k = 1; k < radius; ++k) sum = hn::Add(sum, hn::LoadU(d, two + at + k));
                // An odd displacement begins with the second of two columns.
                sum = hn::Add(sum, reach % 2 == 0 ? hn::LoadU(d, one + at + radius)
                                                  : hn::Sub(hn::LoadU(d, two + at + radius),
                                                            hn::LoadU(d, one + at)));
                store_first(sum, std::min(kLanes, reach + 1 - x),
                            to + search.place(-reach, dy) + x);
            }
        };
        store(both[0], first[0], out);
        if (kSquares) store(both[1], first[1], out_squares);
    }
}

// ---- the displacements round the best one: rows of three and one lane without meaning -------

// The sums of the products of patch and window. window: the first displacement's first pixel.
template <class Radius>
void correlate_near(Radius radius, const int16_t* patch, const int16_t* window, int32_t* out) {
    const DRow d;
    RowSum sums[9];
    for (int32_t k = 0; k < kAlignRow; k += int32_t(hn::Lanes(d)))
        for (int32_t row = 0; row <= 2 * radius; ++row) {
            const auto pixels = hn::LoadU(d, patch + row * kAlignRow + k);
            for (int32_t j = 0; j < 9; ++j)
                sums[j].add(pixels,
                            hn::LoadU(d, window + (row + j / 3) * kAlignWindowRow + k + j % 3));
        }
    for (int32_t j = 0; j < 3; ++j)
        hn::StoreU(totals(sums[3 * j], sums[3 * j + 1], sums[3 * j + 2], RowSum()), DFour(),
                   out + 4 * j);
}

// Those of the window's pixels, and of their squares where wanted. inside: 1 within the patch.
template <bool kSquares, class Radius>
void box_sums_near(Radius radius, const int16_t* inside, const int16_t* window, int32_t* out,
                   int32_t* out_squares) {
    const DRow d;
    RowSum sums[9], squares[9];
    for (int32_t dx = 0; dx < 3; ++dx) {
        RowSum sum, square;
        const auto add = [&](int32_t row, int32_t k, RowSum& to, RowSum& to_squares) HWY_ATTR {
            const auto own = hn::LoadU(d, inside + k),
                       value = hn::LoadU(d, window + row * kAlignWindowRow + k + dx);
            to.add(value, own);
            if (kSquares) to_squares.add(hn::Mul(value, own), value);
        };
        for (int32_t k = 0; k < kAlignRow; k += int32_t(hn::Lanes(d)))
            for (int32_t row = 2; row <= 2 * radius; ++row) add(row, k, sum, square);
        for (int32_t dy = 0; dy < 3; ++dy) {
            RowSum &own = sums[3 * dy + dx] = sum, &own_square = squares[3 * dy + dx] = square;
            for (int32_t k = 0; k < kAlignRow; k += int32_t(hn::Lanes(d))) {
                add(dy == 2 ? 2 * radius + 1 : dy, k, own, own_square);
                add(dy == 0 ? 1 : 2 * radius + dy, k, own, own_square);
            }
        }
    }
    for (int32_t j = 0; j < 3; ++j) {
        const auto store = [j](const RowSum* from, int32_t* to) HWY_ATTR {
            hn::StoreU(totals(from[3 * j], from[3 * j + 1], from[3 * j + 2], RowSum()), DFour(),
                       to + 4 * j);
        };
        store(sums, out);
        if (kSquares) store(squares, out_squares);
    }
}

// ---- scores ---------------------------------------------------------------------------------

VFloat reciprocal_root(VFloat x) {
    const DFloat d;
    const hn::RebindToUnsigned<DFloat> bits;
    const VFloat half = hn::Mul(hn::Set(d, 0.5f), x);
    VFloat y = hn::BitCast(
        d, hn::Sub(hn::Set(bits, 0x5f3759dfu), hn::ShiftRight<1>(hn::BitCast(bits, x))));
    for (int i = 0; i < 3; ++i)
        y = hn::Mul(y, hn::Sub(hn::Set(d, 1.5f), hn::Mul(hn::Mul(half, y), y)));
    return y;
}

// What the patch alone contributes to the scores of a vector of displacements.
struct PatchTerms {
    V32 n, t;
    VFloat inverse, root, variance, variance_root;
};
PatchTerms patch_terms(V32 n, V32 t, V32 tt, VFloat inverse, VFloat root) {
    const DFloat f;
    const VFloat tf = hn::ConvertTo(f, t);
    const VFloat variance = hn::Sub(hn::ConvertTo(f, tt), hn::Mul(hn::Mul(tf, tf), inverse));
    return {n, t, inverse, root, variance, reciprocal_root(hn::Max(variance, hn::Set(f, 1.0f)))};
}
PatchTerms whole_patch(const AlignRun& run, const AlignScratch& scratch, int32_t all) {
    const D32 d;
    const DFloat f;
    return patch_terms(hn::Set(d, all), hn::Set(d, scratch.full_t), hn::Set(d, scratch.full_tt),
                       hn::Set(f, run.inverse[all - 1]), hn::Set(f, run.root[all - 1]));
}
PatchTerms usable_patch(const AlignRun& run, const AlignScratch& scratch, int32_t at) {
    const D32 d;
    const DFloat f;
    const V32 n = hn::LoadU(d, scratch.n + at), one = hn::Set(d, 1);
    const V32 tt = hn::Add(hn::ShiftLeft<12>(hn::LoadU(d, scratch.tt_high + at)),
                           hn::LoadU(d, scratch.tt_low + at));
    // Lanes beyond the search window hold anything.
    const V32 index = hn::Sub(hn::Min(hn::Max(n, one), hn::Set(d, kAlignRows * kAlignRows)), one);
    return patch_terms(n, hn::LoadU(d, scratch.t_sum + at), tt,
                       hn::GatherIndex(f, run.inverse, index), hn::GatherIndex(f, run.root, index));
}

// kUnscored where there is no score.
V32 scores(const AlignScratch& scratch, const PatchTerms& patch, int32_t all, int32_t at) {
    const D32 d;
    const DFloat f;
    const V32 i = hn::LoadU(d, scratch.i + at), ii = hn::LoadU(d, scratch.ii + at),
              ti = hn::LoadU(d, scratch.ti + at);
    const V32 live_variance = hn::Sub(hn::Mul(patch.n, ii), hn::Mul(i, i));
    const VFloat one = hn::Set(f, 1.0f);
    const VFloat product =
        hn::Mul(hn::Mul(hn::ConvertTo(f, patch.t), hn::ConvertTo(f, i)), patch.inverse);
    const VFloat covariance = hn::Sub(hn::ConvertTo(f, ti), product);
    const VFloat live_root = reciprocal_root(hn::Max(hn::ConvertTo(f, live_variance), one));
    const VFloat z =
        hn::Mul(hn::Mul(hn::Mul(covariance, patch.variance_root), live_root), patch.root);
    const V32 q = hn::ConvertTo(
        d, hn::Floor(hn::Add(hn::Mul(z, hn::Set(f, float(kOneScore))), hn::Set(f, 0.5f))));
    const auto enough = hn::Gt(hn::ShiftLeft<2>(patch.n), hn::Set(d, kMinUsableQuarters * all - 1));
    const auto live = hn::Gt(live_variance, hn::Zero(d));
    const auto good =
        hn::And(hn::And(enough, live), hn::RebindMask(d, hn::Ge(patch.variance, one)));
    return hn::IfThenElse(good, q, hn::Set(d, int32_t(kUnscored)));
}

// The displacements that can be scored: of the search window those inside the image.
struct Limits {
    int32_t left, right, top, bottom;
};

// The displacements (x, y) + (xs[i], ys[i]).
struct Displacements {
    int32_t x, y;
    const int32_t *xs, *ys;
    int32_t count;
};

// The place of the best of the displacements whose sums the scratch holds; -1 if none is scored.
// Displacements for which there is no sum are far outside the limits.
int32_t best_displacement(const AlignRun& run, const AlignScratch& scratch, const Limits& limits,
                          const Displacements& tried) {
    const D32 d;
    const int32_t all =
        int32_t((2 * run.params->patch_radius + 1) * (2 * run.params->patch_radius + 1));
    PatchTerms patch = whole_patch(run, scratch, all);
    // Less than any displacement's.
    V32 best = hn::Set(d, -(1 << 28)), best_at = hn::Set(d, -1);
    for (int32_t at = 0; at < tried.count; at += int32_t(hn::Lanes(d))) {
        const V32 dx = hn::Add(hn::Set(d, tried.x), hn::LoadU(d, tried.xs + at)),
                  dy = hn::Add(hn::Set(d, tried.y), hn::LoadU(d, tried.ys + at));
        if (scratch.masked) patch = usable_patch(run, scratch, at);
        const V32 q = scores(scratch, patch, all, at);
        const V32 squared = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
        const V32 ranked = hn::Sub(q, hn::Mul(squared, hn::Set(d, int32_t(kDistancePenalty))));
        const auto within = [](V32 shift, int32_t first, int32_t last) HWY_ATTR {
            return hn::And(hn::Gt(shift, hn::Set(D32(), first - 1)),
                           hn::Lt(shift, hn::Set(D32(), last + 1)));
        };
        auto better = hn::And(hn::Ne(q, hn::Set(d, int32_t(kUnscored))), hn::Gt(ranked, best));
        better = hn::And(better, hn::And(within(dx, limits.left, limits.right),
                                         within(dy, limits.top, limits.bottom)));
        best = hn::IfThenElse(better, ranked, best);
        best_at = hn::IfThenElse(better, columns_from(d, at), best_at);
    }
    const V32 highest = hn::MaxOfLanes(d, best);
    const V32 candidates = hn::IfThenElse(hn::Eq(best, highest), best_at, hn::Set(d, INT32_MAX));
    return hn::GetLane(hn::MinOfLanes(d, candidates));
}

// Whether somewhere some pixels are missing and not too many.
bool misses_some(int32_t all, int32_t places, const AlignScratch& scratch) {
    const D32 d;
    auto found = hn::Lt(hn::Zero(d), hn::Zero(d));
    for (int32_t at = 0; at < places; at += int32_t(hn::Lanes(d))) {
        const V32 n = hn::LoadU(d, scratch.n + at);
        const auto some =
            hn::And(hn::Lt(n, hn::Set(d, all)),
                    hn::Gt(hn::ShiftLeft<2>(n), hn::Set(d, kMinUsableQuarters * all - 1)));
        const auto exists = hn::Lt(columns_from(d, at), hn::Set(d, places));
        found = hn::Or(found, hn::And(some, exists));
    }
    return !hn::AllFalse(d, found);
}

void split_squares(int32_t height, AlignScratch& scratch) {
    for (int32_t k = 0; k < height * kAlignRow; ++k) {
        const int32_t square = scratch.t[k] * scratch.t[k];
        scratch.high[k] = int16_t(square >> 12);
        scratch.low[k] = int16_t(square & 4095);
    }
}

// Sums at the displacements that are scored first. centre: of the window, the first pixel of the
// patch where it is not displaced.
template <class Radius>
void first_sums(Radius radius, const AlignSearch& search, int32_t centre, AlignScratch& scratch) {
    const int16_t* live = (scratch.masked ? scratch.usable_live : scratch.live) + centre;
    correlate(radius, scratch.t, live, search, scratch.ti);
    box_sums<true>(radius, live, search, scratch.i, scratch.ii);
    if (!scratch.masked) return;
    const int16_t* usable = scratch.usable + centre;
    const int32_t height = 2 * radius + 1, places = search.rows() * search.row_places;
    box_sums<false>(radius, usable, search, scratch.n, scratch.n);
    split_squares(height, scratch);
    if (!misses_some(height * height, places, scratch)) {
        std::fill_n(scratch.t_sum, places, scratch.full_t);
        std::fill_n(scratch.tt_high, places, scratch.full_tt >> 12);
        std::fill_n(scratch.tt_low, places, scratch.full_tt & 4095);
        return;
    }
    correlate(radius, scratch.t, usable, search, scratch.t_sum);
    correlate(radius, scratch.high, usable, search, scratch.tt_high);
    correlate(radius, scratch.low, usable, search, scratch.tt_low);
}

// Likewise round one of them.
template <class Radius>
void near_sums(Radius radius, const AlignPlaces& places, int32_t first, AlignScratch& scratch) {
    const int16_t* live = (scratch.masked ? scratch.usable_live : scratch.live) + first;
    const int16_t* inside = &places.usable[0];
    correlate_near(radius, scratch.t, live, scratch.ti);
    box_sums_near<true>(radius, inside, live, scratch.i, scratch.ii);
    if (!scratch.masked) return;
    const int16_t* usable = scratch.usable + first;
    box_sums_near<false>(radius, inside, usable, scratch.n, scratch.n);
    correlate_near(radius, scratch.t, usable, scratch.t_sum);
    correlate_near(radius, scratch.high, usable, scratch.tt_high);
    correlate_near(radius, scratch.low, usable, scratch.tt_low);
}

// Radius: an integral constant for the usual radii, so that loops unroll, else int32_t.
template <class Radius>
bool find_displacement(Radius radius, const AlignRun& run, const Limits& limits,
                       AlignScratch& scratch, int32_t& dx, int32_t& dy) {
    alignas(64) static constexpr int32_t kNearX[kAlignLanes] = {
        -1, 0, 1, kAlignFar, -1, 0, 1, kAlignFar, -1, 0, 1, kAlignFar, 0, 0, 0, 0};
    alignas(64) static constexpr int32_t kNearY[kAlignLanes] = {
        -1, -1, -1, 0, 0, 0, 0, 0, 1, 1, 1, 0, kAlignFar, kAlignFar, kAlignFar, kAlignFar};
    const AlignPlaces& places = *run.places;
    const int32_t s = int32_t(run.params->search_radius);
    const AlignSearch search(s);
    // The place in the window of the first pixel of the patch that is not displaced.
    const int32_t centre = (s + 1) * (kAlignWindowRow + 1);
    first_sums(radius, search, centre, scratch);
    int32_t at = best_displacement(
        run, scratch, limits,
        {0, 0, &places.shift_x[0], &places.shift_y[0], search.rows() * search.row_places});
    if (at < 0) return false;
    dx = places.shift_x[size_t(at)];
    dy = places.shift_y[size_t(at)];
    near_sums(radius, places, centre + (dy - 1) * kAlignWindowRow + dx - 1, scratch);
    at = best_displacement(run, scratch, limits, {dx, dy, kNearX, kNearY, 12});
    dx += kNearX[at];
    dy += kNearY[at];
    return std::abs(dx) < s && std::abs(dy) < s;
}

bool find_displacement(int32_t radius, const AlignRun& run, const Limits& limits,
                       AlignScratch& scratch, int32_t& dx, int32_t& dy) {
    if (radius == 5)
        return find_displacement(std::integral_constant<int32_t, 5>(), run, limits, scratch, dx,
                                 dy);
    if (radius == 7)
        return find_displacement(std::integral_constant<int32_t, 7>(), run, limits, scratch, dx,
                                 dy);
    return find_displacement<int32_t>(radius, run, limits, scratch, dx, dy);
}

bool search(const AlignRun& run, const AlignCentre& centre,
            const defrec_patch_prediction& prediction, AlignScratch& scratch, AlignPeak& peak) {
    const defrec_align_params& params = *run.params;
    scratch.is_searched = false;
    if (!centre.valid || !usable(prediction, params)) return false;
    const int32_t u = to_level(prediction.u, params.level),
                  v = to_level(prediction.v, params.level);
    const int32_t x = (u + 128) >> 8, y = (v + 128) >> 8, r = int32_t(params.patch_radius),
                  s = int32_t(params.search_radius);
    peak.fraction_x = u - kPatchOne * x;
    peak.fraction_y = v - kPatchOne * y;
    alignas(64) int16_t sampled[kMaxSamples];
    if (!sample_view(run, centre, prediction.view_from_live, peak.fraction_x, peak.fraction_y,
                     sampled) ||
        !prepare_template(sampled, params, scratch))
        return false;
    const Limits limits{std::max(-s, r - x), std::min(s, run.level.width - 1 - r - x),
                        std::max(-s, r - y), std::min(s, run.level.height - 1 - r - y)};
    if (limits.left > limits.right || limits.top > limits.bottom) return false;
    load_window(run.level, x, y, r + s + 1, scratch);
    scratch.is_searched = true;
    int32_t dx = 0, dy = 0;
    if (!find_displacement(r, run, limits, scratch, dx, dy)) return false;
    peak.x = x + dx;
    peak.y = y + dy;
    peak.window_x = r + s + 1 + dx;
    peak.window_y = r + s + 1 + dy;
    return true;
}

int32_t predicted_score(const AlignRun& run, const defrec_patch_prediction& prediction,
                        AlignScratch& scratch) {
    if (!scratch.is_searched) return kUnscored;
    const defrec_align_params& params = *run.params;
    const int32_t x = (to_level(prediction.u, params.level) + 128) >> 8,
                  y = (to_level(prediction.v, params.level) + 128) >> 8,
                  r = int32_t(params.patch_radius), s = int32_t(params.search_radius);
    if (x < r || y < r || x + r >= run.level.width || y + r >= run.level.height) return kUnscored;
    near_sums(r, *run.places, s * (kAlignWindowRow + 1), scratch);
    constexpr int32_t kMiddle = 5;  // of the rows of near_sums()
    const int32_t all = (2 * r + 1) * (2 * r + 1), lanes = int32_t(hn::Lanes(D32())),
                  at = kMiddle / lanes * lanes;
    const PatchTerms patch =
        scratch.masked ? usable_patch(run, scratch, at) : whole_patch(run, scratch, all);
    alignas(64) int32_t q[kAlignLanes];
    hn::StoreU(scores(scratch, patch, all, at), D32(), q);
    return q[kMiddle - at];
}

}  // namespace
}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(search);
bool align_search(const AlignRun& run, const AlignCentre& centre,
                  const defrec_patch_prediction& prediction, AlignScratch& scratch,
                  AlignPeak& peak) {
    return HWY_DYNAMIC_DISPATCH(search)(run, centre, prediction, scratch, peak);
}

HWY_EXPORT(predicted_score);
int32_t align_predicted_score(const AlignRun& run, const defrec_patch_prediction& prediction,
                              AlignScratch& scratch) {
    return HWY_DYNAMIC_DISPATCH(predicted_score)(run, prediction, scratch);
}

}  // namespace defrec::cpu
#endif
