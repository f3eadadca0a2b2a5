// FAST-9 corner scores and the strongest corner of each cell for the stage orb.
#include <algorithm>

#include "backends/cpu/orb_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/orb_fast.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// A cell must fit a vector.
using D8 = hn::ScalableTag<uint8_t>;
using V8 = hn::Vec<D8>;

// The largest over all runs of 9 pixels of the circle of the least of the run (and, with Min and Max
// exchanged, the other way round). Runs that start at 2k and 2k + 1 share 8.
struct Largest {
    static V8 inner(V8 a, V8 b) { return hn::Min(a, b); }
    static V8 outer(V8 a, V8 b) { return hn::Max(a, b); }
};
struct Least {
    static V8 inner(V8 a, V8 b) { return hn::Max(a, b); }
    static V8 outer(V8 a, V8 b) { return hn::Min(a, b); }
};
template <class Order>
HWY_INLINE V8 best_run(const V8* p) {
    V8 two[8], four[8];
    for (size_t k = 0; k < 8; ++k) two[k] = Order::inner(p[2 * k + 1], p[(2 * k + 2) % 16]);
    for (size_t k = 0; k < 8; ++k) four[k] = Order::inner(two[k], two[(k + 1) % 8]);
    V8 best{};
    for (size_t k = 0; k < 8; ++k) {
        const V8 eight = Order::inner(four[k], four[(k + 2) % 8]);
        const V8 nine = Order::inner(eight, Order::outer(p[2 * k], p[(2 * k + 9) % 16]));
        best = k == 0 ? nine : Order::outer(best, nine);
    }
    return best;
}

// How far the run is brighter than the centre, or darker: the larger of the two.
HWY_INLINE V8 difference(V8 brightest_run, V8 darkest_run, V8 centre) {
    return hn::Max(hn::SaturatedSub(brightest_run, centre), hn::SaturatedSub(centre, darkest_run));
}
HWY_INLINE hn::Mask<D8> at_most(V8 values, V8 limit) {
    return hn::Eq(hn::SaturatedSub(values, limit), hn::Zero(D8()));
}

HWY_INLINE V8 scores_at(const uint8_t* pixel, const ptrdiff_t* circle, V8 threshold) {
    const D8 d;
    const V8 centre = hn::LoadU(d, pixel);
    V8 p[16];
    for (size_t i = 0; i < 16; i += 2) p[i] = hn::LoadU(d, pixel + circle[i]);
    // Every run of 9 holds at least one of two opposite pixels.
    V8 brightest = hn::Max(p[0], p[8]), darkest = hn::Min(p[0], p[8]);
    for (size_t i = 2; i < 8; i += 2) {
        brightest = hn::Min(brightest, hn::Max(p[i], p[i + 8]));
        darkest = hn::Max(darkest, hn::Min(p[i], p[i + 8]));
    }
    if (hn::AllTrue(d, at_most(difference(brightest, darkest, centre), threshold))) return hn::Zero(d);
    for (size_t i = 1; i < 16; i += 2) p[i] = hn::LoadU(d, pixel + circle[i]);
    const V8 score = difference(best_run<Largest>(p), best_run<Least>(p), centre);
    return hn::IfThenZeroElse(at_most(score, threshold), score);
}

// Of rows [0, rows + 6) of the mask, whose row 3 is the band's first: 0 where any pixel within 3 cannot be
// used.
void find_usable(const uint8_t* mask, size_t stride, uint32_t rows, uint8_t* usable) {
    const D8 d;
    const size_t lanes = hn::Lanes(d);
    const uint8_t* across =
        usable;  // least of 7 pixels beside each other, first for all rows, then replaced from above
    for (uint32_t y = 0; y < rows + 6; ++y) {
        const uint8_t* row = mask + y * stride;
        V8 least = hn::LoadU(d, row - 3);
        for (ptrdiff_t dx = -2; dx <= 3; ++dx) least = hn::Min(least, hn::LoadU(d, row + dx));
        hn::Store(least, d, usable + y * lanes);
    }
    for (uint32_t y = 0; y < rows; ++y) {
        V8 least = hn::Load(d, across + y * lanes);
        for (uint32_t dy = 1; dy < 7; ++dy) least = hn::Min(least, hn::Load(d, across + (y + dy) * lanes));
        hn::Store(least, d, usable + y * lanes);
    }
}

// score << 8 | (15 - y) << 4 | (15 - x): the largest is the strongest, then the first in raster order.
uint32_t pack_corner(uint32_t key) {
    return key < 256 ? 0 : (key >> 8) << 16 | (15 - (key >> 4 & 15)) << 8 | (15 - (key & 15));
}

void find_corners(const OrbBand& band) {
    const D8 d;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    const uint32_t cells_at_once = lanes / band.cell, step = cells_at_once * band.cell;
    const uint32_t end = band.width - uint32_t(orb::kBorder);
    const V8 threshold = hn::Set(d, uint8_t(band.threshold));
    ptrdiff_t circle[16];
    for (size_t i = 0; i < 16; ++i)
        circle[i] = orb::kCircle[i].y * ptrdiff_t(band.image.stride) + orb::kCircle[i].x;

    HWY_ALIGN uint8_t usable[hn::MaxLanes(d) * (orb::kLargestCell + 6)];
    HWY_ALIGN uint8_t best_of_column[hn::MaxLanes(d)], row_of_column[hn::MaxLanes(d)];
    uint32_t* corner = band.corners;
    for (uint32_t x = uint32_t(orb::kBorder); x < end; x += step) {
        const auto inside = hn::FirstN(d, std::min(end - x, lanes));
        if (band.mask.data != nullptr)
            find_usable(band.mask.row(band.first - 3) + x, band.mask.stride, band.last - band.first, usable);
        V8 best = hn::Zero(d), best_row = hn::Zero(d);
        for (uint32_t y = band.first; y < band.last; ++y) {
            V8 score = hn::IfThenElseZero(inside, scores_at(band.image.row(y) + x, circle, threshold));
            if (band.mask.data != nullptr)
                score = hn::IfThenZeroElse(
                    hn::Eq(hn::Load(d, usable + (y - band.first) * lanes), hn::Zero(d)), score);
            hn::StoreU(score, d, band.scores.row(y) + x);
            const auto as_good = hn::Eq(hn::Max(best, score), best);
            best_row = hn::IfThenElse(as_good, best_row, hn::Set(d, uint8_t(y - band.first)));
            best = hn::Max(best, score);
        }
        hn::Store(best, d, best_of_column);
        hn::Store(best_row, d, row_of_column);
        for (uint32_t c = 0; c < cells_at_once && x + c * band.cell < end; ++c) {
            uint32_t key = 0;
            for (uint32_t i = 0; i < band.cell; ++i) {
                const uint32_t lane = c * band.cell + i;
                key = std::max(
                    key, uint32_t(best_of_column[lane]) << 8 | (15u - row_of_column[lane]) << 4 | (15 - i));
            }
            *corner++ = pack_corner(key);
        }
    }
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(find_corners);
void orb_find_corners(const OrbBand& band) { HWY_DYNAMIC_DISPATCH(find_corners)(band); }

}  // namespace defrec::cpu
#endif
