// The sub-pixel position of a found patch: Gauss-Newton on a shift of the live image.
#include <optional>

#include "backends/cpu/align_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/align_refine.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

#include "backends/cpu/align_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace {
using namespace align;

using VRow = hn::Vec<DRow>;
using VPairs = hn::Vec<DPairs>;

// A patch's pixels in rows of kAlignRow, 0 where not usable; x and y are offsets from its centre.
struct Patch {
    const int16_t *t, *gx, *gy, *usable, *x, *y;
    int32_t count;  // of all rows
};

Patch whole_patch(const AlignScratch& scratch, const AlignPlaces& places, int32_t radius) {
    return {scratch.t,
            scratch.gx,
            scratch.gy,
            &places.usable[0],
            &places.x[0],
            &places.y[0],
            (2 * radius + 1) * kAlignRow};
}

// The pixels of the whole patch that are usable.
class MaskedPatch {
  public:
    MaskedPatch(const AlignScratch& scratch, const AlignPeak& peak, const Patch& whole,
                int32_t radius) {
        const DRow d;
        const int16_t* corner =
            scratch.usable + (peak.window_y - radius) * kAlignWindowRow + peak.window_x - radius;
        for (int32_t k = 0; k < whole.count; k += int32_t(hn::Lanes(d))) {
            const int32_t at = k / kAlignRow * kAlignWindowRow + k % kAlignRow;
            const auto usable = hn::Mul(hn::LoadU(d, corner + at), hn::LoadU(d, whole.usable + k));
            hn::StoreU(usable, d, usable_ + k);
            const auto mask = [&](const int16_t* from, int16_t* to) HWY_ATTR {
                hn::StoreU(hn::Mul(usable, hn::LoadU(d, from + k)), d, to + k);
            };
            mask(whole.t, t_);
            mask(whole.gx, gx_);
            mask(whole.gy, gy_);
            mask(whole.x, x_);
            mask(whole.y, y_);
        }
        patch_ = {t_, gx_, gy_, usable_, x_, y_, whole.count};
    }
    const Patch& patch() const { return patch_; }

  private:
    alignas(64) int16_t t_[kAlignRows * kAlignRow], gx_[kAlignRows * kAlignRow],
        gy_[kAlignRows * kAlignRow], usable_[kAlignRows * kAlignRow], x_[kAlignRows * kAlignRow],
        y_[kAlignRows * kAlignRow];
    Patch patch_;
};

// Sets those of n, x and y alone.
void sum_places(const Patch& patch, TemplateSums& sums) {
    const DRow d;
    RowSum n, x, y, xx, xy, yy;
    for (int32_t k = 0; k < patch.count; k += int32_t(hn::Lanes(d))) {
        const auto usable = hn::LoadU(d, patch.usable + k), column = hn::LoadU(d, patch.x + k),
                   row = hn::LoadU(d, patch.y + k);
        n.add(usable, usable);
        x.add(column, usable);
        y.add(row, usable);
        xx.add(column, column);
        xy.add(column, row);
        yy.add(row, row);
    }
    int32_t s[8];
    hn::StoreU(totals(n, x, y, xx), DFour(), s);
    hn::StoreU(totals(xy, yy, RowSum(), RowSum()), DFour(), s + 4);
    sums.n = s[0], sums.x = s[1], sums.y = s[2];
    sums.xx = s[3], sums.xy = s[4], sums.yy = s[5];
}
// Sets the others.
void sum_template(const Patch& patch, TemplateSums& sums) {
    const DRow d;
    RowSum t, gx, gy, xt, yt, xgx, ygx, xgy, ygy, tt, gxx, gxy, gyy, gxt, gyt;
    for (int32_t k = 0; k < patch.count; k += int32_t(hn::Lanes(d))) {
        const auto usable = hn::LoadU(d, patch.usable + k), value = hn::LoadU(d, patch.t + k);
        const auto across = hn::LoadU(d, patch.gx + k), down = hn::LoadU(d, patch.gy + k);
        const auto column = hn::LoadU(d, patch.x + k), row = hn::LoadU(d, patch.y + k);
        t.add(value, usable);
        gx.add(across, usable);
        gy.add(down, usable);
        xt.add(column, value);
        yt.add(row, value);
        xgx.add(column, across);
        ygx.add(row, across);
        xgy.add(column, down);
        ygy.add(row, down);
        tt.add(value, value);
        gxx.add(across, across);
        gxy.add(across, down);
        gyy.add(down, down);
        gxt.add(across, value);
        gyt.add(down, value);
    }
    int32_t s[16];
    hn::StoreU(totals(t, gx, gy, xt), DFour(), s);
    hn::StoreU(totals(yt, xgx, ygx, xgy), DFour(), s + 4);
    hn::StoreU(totals(ygy, tt, gxx, gxy), DFour(), s + 8);
    hn::StoreU(totals(gyy, gxt, gyt, RowSum()), DFour(), s + 12);
    sums.t = s[0], sums.gx = s[1], sums.gy = s[2], sums.xt = s[3], sums.yt = s[4];
    sums.xgx = s[5], sums.ygx = s[6], sums.xgy = s[7], sums.ygy = s[8];
    sums.tt = s[9], sums.gxx = s[10], sums.gxy = s[11], sums.gyy = s[12];
    sums.gxt = s[13], sums.gyt = s[14];
}

// A row of 16-bit values as pairs with the row below: those of even and of odd columns.
struct RowPairs {
    VRow even, odd;
};
RowPairs pair_rows(VRow upper, VRow lower) {
    const DRow d;
    const DPairs pairs;
    const VRow raised = hn::BitCast(d, hn::ShiftLeft<16>(hn::BitCast(pairs, lower))),
               lowered = hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(pairs, upper)));
    return {hn::OddEven(raised, upper), hn::OddEven(lower, lowered)};
}

// Weights of two pixels.
VRow weight_pair(int32_t first, int32_t second) {
    return hn::BitCast(DRow(),
                       hn::Set(DPairs(), (first & 0xffff) | int32_t(uint32_t(second) << 16)));
}
// The sum of four weighted pixels, given as two pairs, and of `round`.
VPairs weigh(VRow first, VRow first_weights, VRow second, VRow second_weights, int32_t round) {
    const DPairs pairs;
    VPairs rest = hn::Zero(pairs);
    VPairs sum = hn::ReorderWidenMulAccumulate(pairs, first, first_weights, hn::Zero(pairs), rest);
    sum = hn::ReorderWidenMulAccumulate(pairs, second, second_weights, sum, rest);
    return hn::Add(hn::RearrangeToOddPlusEven(sum, rest), hn::Set(pairs, round));
}
// Even and odd columns' values, each after a shift to the right, as one row of 16 bits.
template <int kShift>
VRow join(VPairs even, VPairs odd) {
    return hn::OddEven(hn::BitCast(DRow(), hn::ShiftLeft<16 - kShift>(odd)),
                       hn::BitCast(DRow(), hn::ShiftRight<kShift>(even)));
}

// Sums of the live image under the patch, shifted by a fraction of a pixel, 1/4 gray level.
LiveSums live_sums(const Patch& patch, const AlignScratch& scratch, const AlignPeak& peak,
                   int32_t radius, int32_t shift_x, int32_t shift_y) {
    const DRow d;
    int32_t wx[4], wy[4];
    cubic_weights(shift_x & 255, wx);
    cubic_weights(shift_y & 255, wy);
    const VRow left = weight_pair(wx[0], wx[1]), right = weight_pair(wx[2], wx[3]);
    const VRow above = weight_pair(wy[0], wy[1]), below = weight_pair(wy[2], wy[3]);
    const int16_t* corner = scratch.live +
                            (peak.window_y + (shift_y >> 8) - radius - 1) * kAlignWindowRow +
                            peak.window_x + (shift_x >> 8) - radius - 1;
    RowSum i, xi, yi, ii, it, igx, igy;
    for (int32_t column = 0; column < kAlignRow; column += int32_t(hn::Lanes(d))) {
        const auto filtered = [&](int32_t row) HWY_ATTR {
            const int16_t* from = corner + row * kAlignWindowRow + column;
            const VRow first = hn::LoadU(d, from), second = hn::LoadU(d, from + 1),
                       third = hn::LoadU(d, from + 2), fourth = hn::LoadU(d, from + 3);
            return join<4>(weigh(first, left, third, right, 8),
                           weigh(second, left, fourth, right, 8));
        };
        VRow last = filtered(2);
        RowPairs upper, middle;
        {
            const VRow first = filtered(0), second = filtered(1);
            upper = pair_rows(first, second);
            middle = pair_rows(second, last);
        }
        for (int32_t row = 0; row <= 2 * radius; ++row) {
            const VRow next = filtered(row + 3);
            const RowPairs lower = pair_rows(last, next);
            const VRow shifted = join<10>(weigh(upper.even, above, lower.even, below, 512),
                                          weigh(upper.odd, above, lower.odd, below, 512));
            upper = middle;
            middle = lower;
            last = next;
            const int32_t k = row * kAlignRow + column;
            const VRow usable = hn::LoadU(d, patch.usable + k), value = hn::Mul(shifted, usable);
            i.add(value, usable);
            xi.add(value, hn::LoadU(d, patch.x + k));
            yi.add(value, hn::LoadU(d, patch.y + k));
            ii.add(value, value);
            it.add(value, hn::LoadU(d, patch.t + k));
            igx.add(value, hn::LoadU(d, patch.gx + k));
            igy.add(value, hn::LoadU(d, patch.gy + k));
        }
    }
    int32_t s[8];
    hn::StoreU(totals(i, xi, yi, ii), DFour(), s);
    hn::StoreU(totals(it, igx, igy, RowSum()), DFour(), s + 4);
    return {s[0], s[1], s[2], s[3], s[4], s[5], s[6]};
}

void refine(const AlignRun& run, const AlignScratch& scratch, const AlignPeak& peak,
            defrec_patch_observation& result) {
    const int32_t r = int32_t(run.params->patch_radius);
    if (peak.x < r + 2 || peak.y < r + 2 || peak.x + r + 2 >= run.level.width ||
        peak.y + r + 2 >= run.level.height)
        return;
    Patch patch = whole_patch(scratch, *run.places, r);
    std::optional<MaskedPatch> masked;
    TemplateSums sums = run.places->sums;
    LightFits fits = run.places->fits;
    if (scratch.masked) {
        patch = masked.emplace(scratch, peak, patch, r).patch();
        sum_places(patch, sums);
        fits = make_light_fits(sums, run.inverse[sums.n - 1]);
    }
    sum_template(patch, sums);
    ShiftSystem system{};
    int32_t shift_x = 0, shift_y = 0, score = 0;
    for (int32_t k = 0; k < kShiftSteps; ++k) {
        const LiveSums live = live_sums(patch, scratch, peak, r, shift_x, shift_y);
        const ShiftStep step =
            k == 0 ? first_shift_step(sums, fits, live, system) : shift_step(system, live);
        if (!step.valid) return;
        score = step.score;
        shift_x += step.x;
        shift_y += step.y;
        if (shift_x < -kPatchOne || shift_y < -kPatchOne || shift_x >= kPatchOne ||
            shift_y >= kPatchOne)
            return;
        if (step.is_short()) break;
    }
    if (score >> kScoreShift < int32_t(run.params->min_score)) return;
    const uint32_t level = run.params->level, side = 2 * run.params->patch_radius + 1;
    result.u = from_level(kPatchOne * peak.x + peak.fraction_x + shift_x, level);
    result.v = from_level(kPatchOne * peak.y + peak.fraction_y + shift_y, level);
    result.score = score >> kScoreShift;
    result.valid = 1;
    information(system, side * side, score, level, result.information);
}

}  // namespace
}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(refine);
void align_refine(const AlignRun& run, const AlignScratch& scratch, const AlignPeak& peak,
                  defrec_patch_observation& result) {
    HWY_DYNAMIC_DISPATCH(refine)(run, scratch, peak, result);
}

}  // namespace defrec::cpu
#endif
