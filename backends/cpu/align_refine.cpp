// The sub-pixel position of a found patch: Gauss-Newton on a shift of the live image.
#include <optional>

#include "backends/cpu/align_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/align_refine.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace {
using namespace align;

using D32 = hn::CappedTag<int32_t, kAlignRow>;
using D16 = hn::CappedTag<int16_t, kAlignRow>;
using DPairs = hn::Repartition<int32_t, D16>;
using V32 = hn::Vec<D32>;

constexpr int32_t kShiftRows = kAlignRows + 3;

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
        const D16 d;
        const DPairs pairs;
        const hn::Rebind<int16_t, DPairs> narrow;
        const int32_t* corner =
            scratch.usable + (peak.window_y - radius) * kAlignWindowRow + peak.window_x - radius;
        for (int32_t k = 0; k < whole.count; k += int32_t(hn::Lanes(pairs))) {
            const int32_t* from = corner + k / kAlignRow * kAlignWindowRow + k % kAlignRow;
            const auto usable = hn::And(hn::LoadU(pairs, from), hn::Set(pairs, 1));
            hn::StoreU(hn::DemoteTo(narrow, usable), narrow, usable_ + k);
        }
        for (int32_t k = 0; k < whole.count; k += int32_t(hn::Lanes(d))) {
            const auto usable = hn::Mul(hn::LoadU(d, usable_ + k), hn::LoadU(d, whole.usable + k));
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

// Adds up products of 16-bit values.
class Sum {
  public:
    Sum() : sum_(hn::Zero(DPairs())), rest_(hn::Zero(DPairs())) {}
    void add(hn::Vec<D16> a, hn::Vec<D16> b) {
        sum_ = hn::ReorderWidenMulAccumulate(DPairs(), a, b, sum_, rest_);
    }
    int32_t total() const { return hn::GetLane(hn::SumOfLanes(DPairs(), hn::Add(sum_, rest_))); }

  private:
    hn::Vec<DPairs> sum_, rest_;
};

TemplateSums template_sums(const Patch& patch) {
    const D16 d;
    Sum n, x, y, xx, xy, yy, t, gx, gy, xt, yt, xgx, ygx, xgy, ygy, tt, gxx, gxy, gyy, gxt, gyt;
    for (int32_t k = 0; k < patch.count; k += int32_t(hn::Lanes(d))) {
        const auto usable = hn::LoadU(d, patch.usable + k), value = hn::LoadU(d, patch.t + k);
        const auto across = hn::LoadU(d, patch.gx + k), down = hn::LoadU(d, patch.gy + k);
        const auto column = hn::LoadU(d, patch.x + k), row = hn::LoadU(d, patch.y + k);
        n.add(usable, usable);
        x.add(column, usable);
        y.add(row, usable);
        xx.add(column, column);
        xy.add(column, row);
        yy.add(row, row);
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
    return {n.total(),   x.total(),   y.total(),   xx.total(), xy.total(),  yy.total(),
            t.total(),   gx.total(),  gy.total(),  xt.total(), yt.total(),  xgx.total(),
            ygx.total(), xgy.total(), ygy.total(), tt.total(), gxx.total(), gxy.total(),
            gyy.total(), gxt.total(), gyt.total()};
}

V32 multiply_pairs(V32 a, V32 b) {
    const hn::Repartition<int16_t, D32> d;
    V32 rest = hn::Zero(D32());
    const V32 sum = hn::ReorderWidenMulAccumulate(D32(), hn::BitCast(d, a), hn::BitCast(d, b),
                                                  hn::Zero(D32()), rest);
    return hn::RearrangeToOddPlusEven(sum, rest);
}
V32 weight_pair(int32_t low, int32_t high) {
    return hn::Set(D32(), (low & 0xffff) | int32_t(uint32_t(high) << 16));
}

// The live image under the patch, shifted by a fraction of a pixel, 1/4 gray level.
void shift_live(const AlignScratch& scratch, const AlignPeak& peak, int32_t radius, int32_t shift_x,
                int32_t shift_y, int16_t* out) {
    const D32 d;
    const hn::Rebind<int16_t, D32> narrow;
    int32_t wx[4], wy[4];
    cubic_weights(shift_x & 255, wx);
    cubic_weights(shift_y & 255, wy);
    const V32 left = weight_pair(wx[0], wx[1]), right = weight_pair(wx[2], wx[3]);
    const V32 above = weight_pair(wy[0], wy[1]), below = weight_pair(wy[2], wy[3]);
    const int32_t side = 2 * radius + 1;
    const int32_t* corner = scratch.live +
                            (peak.window_y + (shift_y >> 8) - radius - 1) * kAlignWindowRow +
                            peak.window_x + (shift_x >> 8) - radius;
    alignas(64) int32_t rows[kShiftRows * kAlignRow];
    const int32_t lanes = int32_t(hn::Lanes(d));
    for (int32_t column = 0; column < kAlignRow; column += lanes) {
        for (int32_t row = 0; row < side + 3; ++row) {
            const int32_t* from = corner + row * kAlignWindowRow + column;
            const V32 sum = hn::Add(multiply_pairs(hn::LoadU(d, from - 1), left),
                                    multiply_pairs(hn::LoadU(d, from + 1), right));
            hn::StoreU(hn::ShiftRight<4>(hn::Add(sum, hn::Set(d, 8))), d,
                       rows + row * kAlignRow + column);
        }
        const auto pair = [&](int32_t row) HWY_ATTR {
            const int32_t* from = rows + row * kAlignRow + column;
            return hn::Or(hn::And(hn::LoadU(d, from), hn::Set(d, 0xffff)),
                          hn::ShiftLeft<16>(hn::LoadU(d, from + kAlignRow)));
        };
        for (int32_t row = 0; row < side; ++row) {
            const V32 sum =
                hn::Add(multiply_pairs(pair(row), above), multiply_pairs(pair(row + 2), below));
            hn::StoreU(hn::DemoteTo(narrow, hn::ShiftRight<10>(hn::Add(sum, hn::Set(d, 512)))),
                       narrow, out + row * kAlignRow + column);
        }
    }
}

LiveSums live_sums(const Patch& patch, const int16_t* live) {
    const D16 d;
    Sum i, xi, yi, ii, it, igx, igy;
    for (int32_t k = 0; k < patch.count; k += int32_t(hn::Lanes(d))) {
        const auto usable = hn::LoadU(d, patch.usable + k),
                   value = hn::Mul(hn::LoadU(d, live + k), usable);
        i.add(value, usable);
        xi.add(value, hn::LoadU(d, patch.x + k));
        yi.add(value, hn::LoadU(d, patch.y + k));
        ii.add(value, value);
        it.add(value, hn::LoadU(d, patch.t + k));
        igx.add(value, hn::LoadU(d, patch.gx + k));
        igy.add(value, hn::LoadU(d, patch.gy + k));
    }
    return {i.total(), xi.total(), yi.total(), ii.total(), it.total(), igx.total(), igy.total()};
}

void refine(const AlignRun& run, const AlignScratch& scratch, const AlignPeak& peak,
            defrec_patch_observation& result) {
    const int32_t r = int32_t(run.params->patch_radius);
    if (peak.x < r + 2 || peak.y < r + 2 || peak.x + r + 2 >= run.level.width ||
        peak.y + r + 2 >= run.level.height)
        return;
    Patch patch = whole_patch(scratch, *run.places, r);
    std::optional<MaskedPatch> masked;
    if (scratch.masked) patch = masked.emplace(scratch, peak, patch, r).patch();
    const TemplateSums sums = template_sums(patch);
    ShiftSystem system{};
    int32_t shift_x = 0, shift_y = 0, score = 0;
    for (int32_t k = 0; k < kShiftSteps; ++k) {
        alignas(64) int16_t shifted[kAlignRows * kAlignRow];
        shift_live(scratch, peak, r, shift_x, shift_y, shifted);
        const LiveSums live = live_sums(patch, shifted);
        const ShiftStep step = k == 0
                                   ? first_shift_step(sums, run.inverse[sums.n - 1], live, system)
                                   : shift_step(system, live);
        if (!step.valid) return;
        score = step.score;
        if (step.x == 0 && step.y == 0) break;  // every further step would be the same
        shift_x += step.x;
        shift_y += step.y;
        if (shift_x < -256 || shift_y < -256 || shift_x > 255 || shift_y > 255) return;
    }
    if (score >> 4 < int32_t(run.params->min_score)) return;
    const uint32_t level = run.params->level, side = 2 * run.params->patch_radius + 1;
    result.u = from_level(256 * peak.x + peak.fraction_x + shift_x, level);
    result.v = from_level(256 * peak.y + peak.fraction_y + shift_y, level);
    result.score = score >> 4;
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
