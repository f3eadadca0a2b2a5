// Sampling a patch from its view, and its ZNCC over the search window: lanes are displacements
// along x.
#include <algorithm>
#include <cstring>
#include <type_traits>

#include "backends/cpu/align_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/align_search.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace {
using namespace align;

using D32 = hn::CappedTag<int32_t, 16>;
using D16 = hn::Repartition<int16_t, D32>;
using DRow = hn::CappedTag<int16_t, kAlignRow>;
using DFloat = hn::RebindToFloat<D32>;
using V32 = hn::Vec<D32>;
using VFloat = hn::Vec<DFloat>;

// Of a sampled patch, with room behind it for vectors.
constexpr int32_t kMaxSamples = (kAlignRows + 2) * (kAlignRows + 2) + 2 * kAlignLanes;

// x, x + 1, ... Highway's Iota of a variable goes through memory, lane by lane.
template <class D, class T = hn::TFromD<D>>
hn::Vec<D> columns_from(D d, int32_t x) {
    return hn::Add(hn::Iota(d, 0), hn::Set(d, T(x)));
}

// Sum of the products of two rows' halves.
V32 multiply_pairs(V32 a, V32 b, V32 sum, V32& rest) {
    return hn::ReorderWidenMulAccumulate(D32(), hn::BitCast(D16(), a), hn::BitCast(D16(), b), sum,
                                         rest);
}
V32 multiply_pairs(V32 a, V32 b) {
    V32 rest = hn::Zero(D32());
    const V32 sum = multiply_pairs(a, b, hn::Zero(D32()), rest);
    return hn::RearrangeToOddPlusEven(sum, rest);
}

// The patch and one pixel round it, row by row, 1/16 gray level; false where it leaves the view.
bool sample_view(const AlignView& view, const AlignCentre& centre, const int32_t m[4],
                 int32_t fraction_x, int32_t fraction_y, int32_t reach, const AlignPlaces& places,
                 int16_t* out) {
    const auto at = [centre, m](int axis, int32_t dx, int32_t dy) {
        return 256 * (axis == 0 ? centre.x : centre.y) +
               ((m[2 * axis] * dx + m[2 * axis + 1] * dy + 128) >> 8);
    };
    // Positions grow or fall along rows and columns, so the corners are the extremes.
    for (const int32_t oy : {-reach, reach})
        for (const int32_t ox : {-reach, reach}) {
            const int32_t dx = 256 * ox - fraction_x, dy = 256 * oy - fraction_y;
            const int32_t x0 = at(0, dx, dy) >> 15, y0 = at(1, dx, dy) >> 15;
            if (x0 < 0 || y0 < 0 || x0 + 1 >= view.width || y0 + 1 >= view.height) return false;
        }
    const D32 d;
    const hn::Rebind<int16_t, D32> narrow;
    const auto byte = hn::Set(d, 255);
    const int32_t count = (2 * reach + 1) * (2 * reach + 1);
    for (int32_t k = 0; k < count; k += int32_t(hn::Lanes(d))) {
        const V32 dx = hn::Sub(hn::ShiftLeft<8>(hn::LoadU(d, &places.sample_x[size_t(k)])),
                               hn::Set(d, fraction_x)),
                  dy = hn::Sub(hn::ShiftLeft<8>(hn::LoadU(d, &places.sample_y[size_t(k)])),
                               hn::Set(d, fraction_y));
        const auto position = [&](int32_t origin, int32_t across, int32_t down) HWY_ATTR {
            const V32 along = hn::Mul(hn::Set(d, across), dx);
            const V32 sum = hn::Add(hn::Add(along, hn::Mul(hn::Set(d, down), dy)), hn::Set(d, 128));
            return hn::Add(hn::Set(d, 256 * origin), hn::ShiftRight<8>(sum));
        };
        const V32 x = position(centre.x, m[0], m[1]), y = position(centre.y, m[2], m[3]);
        const V32 fx = hn::And(hn::ShiftRight<7>(x), byte),
                  fy = hn::And(hn::ShiftRight<7>(y), byte);
        const V32 offset =
            hn::Add(hn::Mul(hn::ShiftRight<15>(y), hn::Set(d, view.width)), hn::ShiftRight<15>(x));
        const V32 weights = hn::Or(hn::Sub(hn::Set(d, 256), fx), hn::ShiftLeft<16>(fx));
        // Two pixels of a row, of the four bytes from the left one on.
        const auto blend = [&](const uint8_t* pixels) HWY_ATTR {
            const V32 four = hn::GatherOffset(d, reinterpret_cast<const int32_t*>(pixels), offset);
            const V32 pair =
                hn::Or(hn::And(four, byte), hn::ShiftLeft<8>(hn::And(four, hn::Set(d, 0xff00))));
            return multiply_pairs(pair, weights);
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

// The bytes of a line from x on, at least 2 * kAlignWindowRow of them readable and `count` of them
// meant, repeating the border's.
const uint8_t* window_row(const AlignLevel& level, const uint8_t* image, int32_t x, int32_t y,
                          int32_t count, uint8_t* buffer) {
    const size_t line = size_t(std::clamp(y, 0, level.height - 1)) * level.stride;
    const uint8_t* row = image + line;
    if (x >= 0 && x + count <= level.width) {
        if (line + size_t(x) + 2 * kAlignWindowRow <= level.size) return row + x;
        std::memcpy(buffer, row + x, size_t(count));
    } else {
        for (int32_t k = 0; k < count; ++k) buffer[k] = row[std::clamp(x + k, 0, level.width - 1)];
    }
    return buffer;
}

V32 load_pair(const uint8_t* row) {
    const D32 d;
    const hn::Rebind<uint8_t, D32> bytes;
    return hn::Or(hn::PromoteTo(d, hn::LoadU(bytes, row)),
                  hn::ShiftLeft<16>(hn::PromoteTo(d, hn::LoadU(bytes, row + 1))));
}

// Whether a pixel of the window round (x, y) is masked.
bool window_is_masked(const AlignLevel& level, int32_t x, int32_t y, int32_t reach) {
    if (level.mask == nullptr) return false;
    const hn::CappedTag<uint8_t, kAlignWindowRow> d;
    const int32_t count = 2 * reach + 2;
    alignas(64) uint8_t buffer[2 * kAlignWindowRow] = {};
    auto minimum = hn::Set(d, 255);
    for (int32_t j = 0; j < 2 * reach + 1; ++j) {
        const uint8_t* row = window_row(level, level.mask, x - reach, y - reach + j, count, buffer);
        for (int32_t k = 0; k < count; k += int32_t(hn::Lanes(d)))
            minimum = hn::Min(minimum, hn::IfThenElse(hn::FirstN(d, size_t(count - k)),
                                                      hn::LoadU(d, row + k), hn::Set(d, 255)));
    }
    return !hn::AllFalse(d, hn::Eq(minimum, hn::Zero(d)));
}

// The pairs of the window round (x, y).
void load_window(const AlignLevel& level, int32_t x, int32_t y, int32_t reach,
                 AlignScratch& scratch) {
    const D32 d;
    const int32_t side = 2 * reach + 1, lanes = int32_t(hn::Lanes(d));
    alignas(64) uint8_t buffer[2 * kAlignWindowRow] = {};
    for (int32_t j = 0; j < side; ++j) {
        const uint8_t* row =
            window_row(level, level.gray, x - reach, y - reach + j, side + 1, buffer);
        for (int32_t k = 0; k < side; k += lanes)
            hn::StoreU(load_pair(row + k), d, scratch.live + j * kAlignWindowRow + k);
    }
    scratch.masked = window_is_masked(level, x, y, reach);
    if (!scratch.masked) return;
    const D16 halves;
    for (int32_t j = 0; j < side; ++j) {
        const uint8_t* row =
            window_row(level, level.mask, x - reach, y - reach + j, side + 1, buffer);
        for (int32_t k = 0; k < side; k += lanes) {
            const int32_t at = j * kAlignWindowRow + k;
            const auto usable =
                hn::Min(hn::BitCast(halves, load_pair(row + k)), hn::Set(halves, 1));
            hn::StoreU(hn::BitCast(d, usable), d, scratch.usable + at);
            const auto live = hn::BitCast(halves, hn::LoadU(d, scratch.live + at));
            hn::StoreU(hn::BitCast(d, hn::Mul(usable, live)), d, scratch.usable_live + at);
        }
    }
}

// Stores the first count lanes.
void store_first(V32 value, int32_t count, int32_t* to) {
    const D32 d;
    if (count >= int32_t(hn::Lanes(d)))
        hn::StoreU(value, d, to);
    else
        hn::BlendedStore(value, hn::FirstN(d, size_t(count)), d, to);
}

V32 pair_of(const int16_t* two) {
    int32_t pair = 0;
    std::memcpy(&pair, two, sizeof pair);
    return hn::Set(D32(), pair);
}

// kRows rows of at most a vector of displacements: the sums of the products of patch and window.
// Unrolled, a vector of the window is loaded once for all rows.
template <int32_t kRows, class Radius>
void correlate_rows(Radius radius, const int16_t* patch, const int32_t* window, int32_t count,
                    int32_t stride, int32_t* out) {
    const D32 d;
    V32 sum[kRows], rest[kRows];
    for (int32_t j = 0; j < kRows; ++j) sum[j] = rest[j] = hn::Zero(d);
    for (int32_t k = 0; k <= 2 * radius; k += 2) {
        for (int32_t row = 0; row <= 2 * radius; ++row) {
            const V32 pair = pair_of(patch + row * kAlignRow + k);
            for (int32_t j = 0; j < kRows; ++j)
                sum[j] = multiply_pairs(hn::LoadU(d, window + (row + j) * kAlignWindowRow + k),
                                        pair, sum[j], rest[j]);
        }
    }
    for (int32_t j = 0; j < kRows; ++j)
        store_first(hn::RearrangeToOddPlusEven(sum[j], rest[j]), count, out + j * stride);
}

// A column of displacements, with rows in lanes.
template <class Radius>
void correlate_column(Radius radius, const int16_t* patch, const int32_t* window, int32_t side,
                      int32_t* out) {
    const D32 d;
    constexpr int32_t kLanes = hn::MaxLanes(D32());
    alignas(64) int32_t column[(kAlignMaxPatchRadius + 1) * kAlignWindowRow];
    for (int32_t row = 0; row < side + 2 * radius; ++row)
        for (int32_t k = 0; k <= radius; ++k)
            column[k * kAlignWindowRow + row] = window[row * kAlignWindowRow + 2 * k];
    for (int32_t dy = 0; dy < side; dy += kLanes) {
        V32 sum = hn::Zero(d), rest = sum;
        for (int32_t k = 0; k <= radius; ++k)
            for (int32_t row = 0; row <= 2 * radius; ++row)
                sum = multiply_pairs(hn::LoadU(d, column + k * kAlignWindowRow + dy + row),
                                     pair_of(patch + row * kAlignRow + 2 * k), sum, rest);
        alignas(64) int32_t sums[kLanes];
        hn::Store(hn::RearrangeToOddPlusEven(sum, rest), d, sums);
        for (int32_t i = 0; i < std::min(kLanes, side - dy); ++i) out[(dy + i) * side] = sums[i];
    }
}

template <class Radius>
void correlate(Radius radius, const int16_t* patch, const int32_t* window, int32_t search,
               AlignSums& out) {
    constexpr int32_t kMostRows = 5;  // at once
    const int32_t lanes = int32_t(hn::Lanes(D32())), side = 2 * search + 1;
    const int32_t* corner = window + kAlignWindowRow + 1;
    for (int32_t x = 0; x < side; x += lanes) {
        const int32_t count = std::min(lanes, side - x);
        if (x > 0 && count == 1) {
            correlate_column(radius, patch, corner + x, side, out + x);
            break;
        }
        // An odd number of rows in parts that are about equal: of 3 to 5.
        const int32_t parts = (side + kMostRows - 1) / kMostRows;
        for (int32_t part = 0; part < parts; ++part) {
            const int32_t dy = side * part / parts, rows = side * (part + 1) / parts - dy;
            const int32_t* from = corner + dy * kAlignWindowRow + x;
            int32_t* to = out + dy * side + x;
            switch (rows) {
                case 3:
                    correlate_rows<3>(radius, patch, from, count, side, to);
                    break;
                case 4:
                    correlate_rows<4>(radius, patch, from, count, side, to);
                    break;
                default:
                    correlate_rows<5>(radius, patch, from, count, side, to);
                    break;
            }
        }
    }
}

// Sums of the window's pixels, and of their squares where wanted, under the patch at each
// displacement: along rows first.
template <bool kSquares, class Radius>
void box_sums(Radius radius, const int32_t* window, int32_t search, AlignSums& out,
              AlignSums& out_squares) {
    const D32 d;
    const D16 halves;
    constexpr int32_t kLanes = hn::MaxLanes(D32());
    const int32_t side = 2 * search + 1, height = 2 * radius + 1, rows = side + 2 * radius;
    const V32 low = hn::Set(d, 0xffff);
    const auto one = hn::Set(halves, 1);
    // Of each row of the window.
    alignas(64) int32_t sums[kAlignWindowRows * kLanes], squares[kAlignWindowRows * kLanes];
    for (int32_t x = 0; x < side; x += kLanes) {
        const int32_t count = std::min(kLanes, side - x);
        const int32_t* corner = window + kAlignWindowRow + 1 + x;
        if (x > 0 && count == 1) {
            // One column more: what the last one's sums lack and have too much.
            int32_t sum = 0, square = 0;
            for (int32_t row = 0; row < rows; ++row) {
                const int32_t* line = corner + row * kAlignWindowRow;
                const int32_t enters = line[2 * radius] & 0xffff, leaves = line[-1] & 0xffff;
                int32_t& own = sums[row * kLanes + kLanes - 1];
                int32_t& own_square = squares[row * kLanes + kLanes - 1];
                sum += own += enters - leaves;
                if (kSquares) square += own_square += enters * enters - leaves * leaves;
                const int32_t dy = row - 2 * radius;
                if (dy < 0) continue;
                out[dy * side + x] = sum;
                sum -= sums[dy * kLanes + kLanes - 1];
                if (!kSquares) continue;
                out_squares[dy * side + x] = square;
                square -= squares[dy * kLanes + kLanes - 1];
            }
            break;
        }
        V32 sum = hn::Zero(d), square = sum;
        for (int32_t row = 0; row < rows; ++row) {
            const int32_t* line = corner + row * kAlignWindowRow;
            auto pairs = hn::Zero(halves);
            V32 own_square = hn::Zero(d), rest = own_square;
            for (int32_t k = 0; k < radius; ++k) {
                const V32 pair = hn::LoadU(d, line + 2 * k);
                pairs = hn::Add(pairs, hn::BitCast(halves, pair));
                if (kSquares) own_square = multiply_pairs(pair, pair, own_square, rest);
            }
            const V32 last = hn::And(hn::LoadU(d, line + 2 * radius), low);
            const V32 own =
                hn::Add(last, multiply_pairs(hn::BitCast(d, pairs), hn::BitCast(d, one)));
            hn::Store(own, d, sums + row * kLanes);
            sum = hn::Add(sum, own);
            if (kSquares) {
                own_square =
                    hn::RearrangeToOddPlusEven(multiply_pairs(last, last, own_square, rest), rest);
                hn::Store(own_square, d, squares + row * kLanes);
                square = hn::Add(square, own_square);
            }
            const int32_t dy = row + 1 - height;
            if (dy < 0) continue;
            store_first(sum, count, out + dy * side + x);
            sum = hn::Sub(sum, hn::Load(d, sums + dy * kLanes));
            if (!kSquares) continue;
            store_first(square, count, out_squares + dy * side + x);
            square = hn::Sub(square, hn::Load(d, squares + dy * kLanes));
        }
    }
}

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
    const auto enough = hn::Gt(hn::ShiftLeft<2>(patch.n), hn::Set(d, 3 * all - 1));
    const auto live = hn::Gt(live_variance, hn::Zero(d));
    const auto good =
        hn::And(hn::And(enough, live), hn::RebindMask(d, hn::Ge(patch.variance, one)));
    return hn::IfThenElse(good, q, hn::Set(d, int32_t(kUnscored)));
}

// The place of the best displacement; -1 if none is scored. columns, rows: those inside the image,
// counted from the corner of the search window.
int32_t best_displacement(const AlignRun& run, const AlignScratch& scratch,
                          const int32_t columns[2], const int32_t rows[2]) {
    const D32 d;
    const int32_t s = int32_t(run.params->search_radius), lanes = int32_t(hn::Lanes(d));
    const int32_t all =
        int32_t((2 * run.params->patch_radius + 1) * (2 * run.params->patch_radius + 1));
    const bool all_inside =
        columns[0] == 0 && columns[1] == 2 * s && rows[0] == 0 && rows[1] == 2 * s;
    PatchTerms patch = whole_patch(run, scratch, all);
    const V32 unscored = hn::Set(d, int32_t(kUnscored));
    // Less than any displacement's.
    V32 best = hn::Set(d, -(1 << 28)), best_at = hn::Set(d, -1);
    for (int32_t at = 0; at < (2 * s + 1) * (2 * s + 1); at += lanes) {
        const V32 dx = hn::LoadU(d, &run.places->shift_x[size_t(at)]),
                  dy = hn::LoadU(d, &run.places->shift_y[size_t(at)]);
        if (scratch.masked) patch = usable_patch(run, scratch, at);
        const V32 q = scores(scratch, patch, all, at);
        const V32 squared = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
        const V32 ranked = hn::Sub(q, hn::Mul(squared, hn::Set(d, int32_t(kDistancePenalty))));
        auto better = hn::And(hn::Ne(q, unscored), hn::Gt(ranked, best));
        // Lanes behind the last displacement hold anything, and a score as high as that may be.
        better = hn::And(better, hn::Ne(dx, hn::Set(d, kAlignFar)));
        if (!all_inside) {
            const auto within = [&](V32 shift, const int32_t* ends) HWY_ATTR {
                return hn::And(hn::Gt(shift, hn::Set(d, ends[0] - s - 1)),
                               hn::Lt(shift, hn::Set(d, ends[1] - s + 1)));
            };
            better = hn::And(better, hn::And(within(dx, columns), within(dy, rows)));
        }
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
        const auto some = hn::And(hn::Lt(n, hn::Set(d, all)),
                                  hn::Gt(hn::ShiftLeft<2>(n), hn::Set(d, 3 * all - 1)));
        const auto exists = hn::Lt(columns_from(d, at), hn::Set(d, places));
        found = hn::Or(found, hn::And(some, exists));
    }
    return !hn::AllFalse(d, found);
}

// The patch's own sums over usable pixels.
template <class Radius>
void usable_sums(Radius radius, int32_t search, AlignScratch& scratch) {
    const int32_t height = 2 * radius + 1, places = (2 * search + 1) * (2 * search + 1);
    if (!misses_some(height * height, places, scratch)) {
        std::fill_n(scratch.t_sum, places, scratch.full_t);
        std::fill_n(scratch.tt_high, places, scratch.full_tt >> 12);
        std::fill_n(scratch.tt_low, places, scratch.full_tt & 4095);
        return;
    }
    for (int32_t k = 0; k < height * kAlignRow; ++k) {
        const int32_t square = scratch.t[k] * scratch.t[k];
        scratch.high[k] = int16_t(square >> 12);
        scratch.low[k] = int16_t(square & 4095);
    }
    correlate(radius, scratch.t, scratch.usable, search, scratch.t_sum);
    correlate(radius, scratch.high, scratch.usable, search, scratch.tt_high);
    correlate(radius, scratch.low, scratch.usable, search, scratch.tt_low);
}

// Radius: an integral constant for the usual radii, so that their loops unroll, else int32_t.
template <class Radius>
void all_sums(Radius radius, int32_t search, AlignScratch& scratch) {
    const int32_t* live = scratch.masked ? scratch.usable_live : scratch.live;
    correlate(radius, scratch.t, live, search, scratch.ti);
    box_sums<true>(radius, live, search, scratch.i, scratch.ii);
    if (!scratch.masked) return;
    box_sums<false>(radius, scratch.usable, search, scratch.n, scratch.n);
    usable_sums(radius, search, scratch);
}

void all_sums(int32_t radius, int32_t search, AlignScratch& scratch) {
    if (radius == 5) return all_sums(std::integral_constant<int32_t, 5>(), search, scratch);
    if (radius == 7) return all_sums(std::integral_constant<int32_t, 7>(), search, scratch);
    all_sums<int32_t>(radius, search, scratch);
}

bool search(const AlignRun& run, const AlignCentre& centre,
            const defrec_patch_prediction& prediction, AlignScratch& scratch, AlignPeak& peak) {
    const defrec_align_params& params = *run.params;
    if (!centre.valid || !usable(prediction, params)) return false;
    const int32_t u = to_level(prediction.u, params.level),
                  v = to_level(prediction.v, params.level);
    const int32_t x = (u + 128) >> 8, y = (v + 128) >> 8, r = int32_t(params.patch_radius),
                  s = int32_t(params.search_radius);
    peak.fraction_x = u - 256 * x;
    peak.fraction_y = v - 256 * y;
    alignas(64) int16_t sampled[kMaxSamples];
    if (!sample_view(run.views[centre.view], centre, prediction.view_from_live, peak.fraction_x,
                     peak.fraction_y, r + 1, *run.places, sampled) ||
        !prepare_template(sampled, params, scratch))
        return false;
    const int32_t columns[2] = {std::max(0, r - x + s),
                                std::min(2 * s, run.level.width - 1 - r - x + s)};
    const int32_t rows[2] = {std::max(0, r - y + s),
                             std::min(2 * s, run.level.height - 1 - r - y + s)};
    if (columns[0] > columns[1] || rows[0] > rows[1]) return false;
    load_window(run.level, x, y, r + s + 1, scratch);
    all_sums(r, s, scratch);
    const int32_t at = best_displacement(run, scratch, columns, rows);
    if (at < 0) return false;
    const int32_t dx = at % (2 * s + 1) - s, dy = at / (2 * s + 1) - s;
    peak.x = x + dx;
    peak.y = y + dy;
    peak.window_x = r + s + 1 + dx;
    peak.window_y = r + s + 1 + dy;
    return std::abs(dx) < s && std::abs(dy) < s;
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

}  // namespace defrec::cpu
#endif
