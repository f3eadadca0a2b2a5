// Sampling a patch from its view, and its ZNCC over the search window: lanes are displacements
// along x.
#include <algorithm>
#include <cstring>
#include <type_traits>
#include <utility>

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

constexpr int32_t kSampleRow = 32;

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

// The patch and one pixel round it, 1/16 gray level; false where it leaves the view.
bool sample_view(const AlignView& view, const AlignCentre& centre, const int32_t m[4],
                 int32_t fraction_x, int32_t fraction_y, int32_t reach, int16_t* out) {
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
    const int32_t side = 2 * reach + 1;
    for (int32_t row = 0; row < side; ++row)
        for (int32_t column = 0; column < side; column += int32_t(hn::Lanes(d))) {
            const int32_t dy = 256 * (row - reach) - fraction_y;
            const V32 dx =
                hn::Sub(hn::ShiftLeft<8>(columns_from(d, column - reach)), hn::Set(d, fraction_x));
            const V32 x = hn::Add(hn::Set(d, 256 * centre.x),
                                  hn::ShiftRight<8>(hn::Add(hn::Mul(hn::Set(d, m[0]), dx),
                                                            hn::Set(d, m[1] * dy + 128))));
            const V32 y = hn::Add(hn::Set(d, 256 * centre.y),
                                  hn::ShiftRight<8>(hn::Add(hn::Mul(hn::Set(d, m[2]), dx),
                                                            hn::Set(d, m[3] * dy + 128))));
            // Only lanes beyond the patch can be outside.
            const V32 x0 =
                hn::Min(hn::Max(hn::ShiftRight<15>(x), hn::Zero(d)), hn::Set(d, view.width - 2));
            const V32 y0 =
                hn::Min(hn::Max(hn::ShiftRight<15>(y), hn::Zero(d)), hn::Set(d, view.height - 2));
            const V32 fx = hn::And(hn::ShiftRight<7>(x), byte),
                      fy = hn::And(hn::ShiftRight<7>(y), byte);
            const V32 offset = hn::Add(hn::Mul(y0, hn::Set(d, view.width)), x0);
            const V32 weights = hn::Or(hn::Sub(hn::Set(d, 256), fx), hn::ShiftLeft<16>(fx));
            // Two pixels of a row, of the four bytes from the left one on.
            const auto blend = [&](const uint8_t* pixels) HWY_ATTR {
                const V32 four =
                    hn::GatherOffset(d, reinterpret_cast<const int32_t*>(pixels), offset);
                const V32 pair = hn::Or(hn::And(four, byte),
                                        hn::ShiftLeft<8>(hn::And(four, hn::Set(d, 0xff00))));
                return multiply_pairs(pair, weights);
            };
            const V32 top = blend(view.pixels), bottom = blend(view.pixels + view.width);
            const V32 value = hn::Add(hn::ShiftLeft<8>(top), hn::Mul(hn::Sub(bottom, top), fy));
            hn::StoreU(hn::DemoteTo(narrow, hn::ShiftRight<12>(hn::Add(value, hn::Set(d, 2048)))),
                       narrow, out + row * kSampleRow + column);
        }
    return true;
}

// Template and gradient into the scratch; false without texture.
bool prepare_template(const int16_t* sampled, const defrec_align_params& params,
                      AlignScratch& scratch) {
    const int32_t r = int32_t(params.patch_radius), side = 2 * r + 1, n = side * side;
    int32_t sum = 0;
    for (int32_t row = 1; row <= side; ++row)
        for (int32_t column = 1; column <= side; ++column)
            sum += sampled[row * kSampleRow + column];
    const int16_t mean = int16_t((2 * sum + n) / (2 * n));
    const DRow d;
    const auto one = hn::Set(d, 1);
    for (int32_t row = 0; row < side; ++row)
        for (int32_t column = 0; column < kAlignRow; column += int32_t(hn::Lanes(d))) {
            const auto inside = hn::Lt(columns_from(d, column), hn::Set(d, int16_t(side)));
            const int16_t* from = sampled + (row + 1) * kSampleRow + column + 1;
            const auto store = [&](hn::Vec<DRow> value, int16_t* to) HWY_ATTR {
                hn::StoreU(hn::IfThenElseZero(inside, value), d, to + row * kAlignRow + column);
            };
            const auto half = [&](const int16_t* high, const int16_t* low) HWY_ATTR {
                return hn::ShiftRight<1>(
                    hn::Add(hn::Sub(hn::LoadU(d, high), hn::LoadU(d, low)), one));
            };
            store(hn::Sub(hn::LoadU(d, from), hn::Set(d, mean)), scratch.t);
            store(half(from + 1, from - 1), scratch.gx);
            store(half(from + kSampleRow, from - kSampleRow), scratch.gy);
        }
    int32_t t = 0, tt = 0;
    for (int32_t k = 0; k < side * kAlignRow; ++k) {
        t += scratch.t[k];
        tt += scratch.t[k] * scratch.t[k];
    }
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

// One row of kBlocks vectors of displacements: the sum of the products of patch and window.
template <class Radius, int kBlocks>
void correlate_row(Radius radius, const int16_t* patch, const int32_t* window, int32_t* out) {
    const D32 d;
    constexpr size_t kLanes = hn::MaxLanes(D32());
    V32 sum[kBlocks], rest[kBlocks];
    for (int b = 0; b < kBlocks; ++b) sum[b] = rest[b] = hn::Zero(d);
    for (int32_t row = 0; row <= 2 * radius; ++row)
        for (int32_t k = 0; k <= radius; ++k) {
            int32_t two = 0;
            std::memcpy(&two, patch + row * kAlignRow + 2 * k, sizeof two);
            const V32 template_pair = hn::Set(d, two);
            for (int b = 0; b < kBlocks; ++b)
                sum[b] = multiply_pairs(
                    hn::LoadU(d, window + row * kAlignWindowRow + 2 * k + int(kLanes) * b),
                    template_pair, sum[b], rest[b]);
        }
    for (int b = 0; b < kBlocks; ++b)
        hn::StoreU(hn::RearrangeToOddPlusEven(sum[b], rest[b]), d, out + int(kLanes) * b);
}

template <class Radius>
void correlate(Radius radius, const int16_t* patch, const int32_t* window, int32_t search,
               AlignSums& out) {
    const int32_t lanes = int32_t(hn::Lanes(D32()));
    const int32_t blocks = (2 * search + lanes) / lanes;
    for (int32_t dy = 0; dy <= 2 * search; ++dy)
        for (int32_t b = 0; b < blocks;) {
            const int32_t* from = window + (dy + 1) * kAlignWindowRow + 1 + b * lanes;
            int32_t* to = out + dy * kAlignScoreRow + b * lanes;
            switch (blocks - b) {
                case 1:
                    correlate_row<Radius, 1>(radius, patch, from, to);
                    b += 1;
                    break;
                case 2:
                    correlate_row<Radius, 2>(radius, patch, from, to);
                    b += 2;
                    break;
                default:
                    correlate_row<Radius, 3>(radius, patch, from, to);
                    b += 3;
                    break;
            }
        }
}

// Sums of the window's pixels, and of their squares where wanted, under the patch at each
// displacement.
template <bool kSquares, class Radius>
void box_sums(Radius radius, const int32_t* window, int32_t search, AlignSums& out,
              AlignSums& out_squares) {
    const D32 d;
    const V32 low = hn::Set(d, 0xffff);
    const int32_t lanes = int32_t(hn::Lanes(d)), columns = 2 * (radius + search) + 1;
    alignas(64) int32_t column[2 * kAlignWindowRow] = {}, squares[2 * kAlignWindowRow] = {};
    const auto row_at = [&](int32_t row, int32_t x) HWY_ATTR {
        return hn::And(hn::LoadU(d, window + (row + 1) * kAlignWindowRow + 1 + x), low);
    };
    const auto slide = [&](int32_t enter, int32_t leave) HWY_ATTR {  // leave: -1 for none
        for (int32_t x = 0; x < columns; x += lanes) {
            const V32 in = row_at(enter, x), out_of = leave < 0 ? hn::Zero(d) : row_at(leave, x);
            hn::Store(hn::Add(hn::Load(d, column + x), hn::Sub(in, out_of)), d, column + x);
            if (kSquares)
                hn::Store(hn::Add(hn::Load(d, squares + x),
                                  hn::Sub(multiply_pairs(in, in), multiply_pairs(out_of, out_of))),
                          d, squares + x);
        }
    };
    for (int32_t row = 0; row < 2 * radius; ++row) slide(row, -1);
    for (int32_t dy = 0; dy <= 2 * search; ++dy) {
        slide(dy + 2 * radius, dy - 1);
        for (int32_t dx = 0; dx <= 2 * search; dx += lanes) {
            V32 sum = hn::LoadU(d, column + dx), sum_squares = hn::LoadU(d, squares + dx);
            for (int32_t k = 1; k <= 2 * radius; ++k) {
                sum = hn::Add(sum, hn::LoadU(d, column + dx + k));
                if (kSquares) sum_squares = hn::Add(sum_squares, hn::LoadU(d, squares + dx + k));
            }
            hn::StoreU(sum, d, out + dy * kAlignScoreRow + dx);
            if (kSquares) hn::StoreU(sum_squares, d, out_squares + dy * kAlignScoreRow + dx);
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

// The best displacement, counted from the corner of the search window; -1 if none is scored.
// columns, rows: those inside the image.
int32_t best_displacement(const AlignRun& run, const AlignScratch& scratch,
                          const int32_t columns[2], const int32_t rows[2]) {
    const D32 d;
    const int32_t s = int32_t(run.params->search_radius), lanes = int32_t(hn::Lanes(d));
    const int32_t all =
        int32_t((2 * run.params->patch_radius + 1) * (2 * run.params->patch_radius + 1));
    PatchTerms patch = whole_patch(run, scratch, all);
    const V32 unscored = hn::Set(d, int32_t(kUnscored));
    V32 best = unscored, best_at = hn::Set(d, -1);
    for (int32_t y = rows[0]; y <= rows[1]; ++y)
        for (int32_t x = 0; x <= 2 * s; x += lanes) {
            const V32 column = columns_from(d, x), dx = hn::Sub(column, hn::Set(d, s));
            const int32_t at = y * kAlignScoreRow + x;
            if (scratch.masked) patch = usable_patch(run, scratch, at);
            const V32 q = scores(scratch, patch, all, at);
            const V32 squared = hn::Add(hn::Mul(dx, dx), hn::Set(d, (y - s) * (y - s)));
            const V32 ranked = hn::Sub(q, hn::Mul(squared, hn::Set(d, int32_t(kDistancePenalty))));
            const auto inside = hn::And(hn::Gt(column, hn::Set(d, columns[0] - 1)),
                                        hn::Lt(column, hn::Set(d, columns[1] + 1)));
            const auto better = hn::And(hn::And(inside, hn::Ne(q, unscored)), hn::Gt(ranked, best));
            best = hn::IfThenElse(better, ranked, best);
            best_at = hn::IfThenElse(better, hn::Add(hn::Set(d, y * (2 * s + 1)), column), best_at);
        }
    const V32 highest = hn::MaxOfLanes(d, best);
    const V32 candidates = hn::IfThenElse(hn::Eq(best, highest), best_at, hn::Set(d, INT32_MAX));
    return hn::GetLane(hn::MinOfLanes(d, candidates));
}

// The patch's own sums over usable pixels, computed only where some are missing and not too many.
template <class Radius>
void usable_sums(Radius radius, int32_t search, AlignScratch& scratch) {
    const D32 d;
    const int32_t all = (2 * radius + 1) * (2 * radius + 1), lanes = int32_t(hn::Lanes(d));
    const std::pair<const int16_t*, int32_t*> sums[] = {
        {scratch.t, scratch.t_sum}, {scratch.high, scratch.tt_high}, {scratch.low, scratch.tt_low}};
    for (int32_t dy = 0; dy <= 2 * search; ++dy)
        for (int32_t dx = 0; dx <= 2 * search; dx += lanes) {
            const int32_t at = dy * kAlignScoreRow + dx;
            const V32 n = hn::LoadU(d, scratch.n + at);
            const auto some = hn::And(hn::Lt(n, hn::Set(d, all)),
                                      hn::Gt(hn::ShiftLeft<2>(n), hn::Set(d, 3 * all - 1)));
            const auto wanted = hn::Lt(columns_from(d, dx), hn::Set(d, 2 * search + 1));
            if (hn::AllFalse(d, hn::And(some, wanted))) {
                hn::StoreU(hn::Set(d, scratch.full_t), d, scratch.t_sum + at);
                hn::StoreU(hn::Set(d, scratch.full_tt >> 12), d, scratch.tt_high + at);
                hn::StoreU(hn::Set(d, scratch.full_tt & 4095), d, scratch.tt_low + at);
                continue;
            }
            const int32_t* from = scratch.usable + (dy + 1) * kAlignWindowRow + 1 + dx;
            for (const auto& [patch, out] : sums)
                correlate_row<Radius, 1>(radius, patch, from, out + at);
        }
}

// Radius: an integral constant for the usual radii, so that their loops unroll, else int32_t.
template <class Radius>
void all_sums(Radius radius, int32_t search, AlignScratch& scratch) {
    const int32_t* live = scratch.masked ? scratch.usable_live : scratch.live;
    correlate(radius, scratch.t, live, search, scratch.ti);
    box_sums<true>(radius, live, search, scratch.i, scratch.ii);
    if (!scratch.masked) return;
    for (int32_t k = 0; k < (2 * radius + 1) * kAlignRow; ++k) {
        const int32_t square = scratch.t[k] * scratch.t[k];
        scratch.high[k] = int16_t(square >> 12);
        scratch.low[k] = int16_t(square & 4095);
    }
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
    alignas(64) int16_t sampled[(kAlignRows + 2) * kSampleRow];
    if (!sample_view(run.views[centre.view], centre, prediction.view_from_live, peak.fraction_x,
                     peak.fraction_y, r + 1, sampled) ||
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
