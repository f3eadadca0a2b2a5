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

// The largest over all runs of 9 pixels of the circle of the least of the run (and, with Min and
// Max exchanged, the other way round). Runs that start at 2k and 2k + 1 share 8.
struct Largest {
    template <class V>
    static HWY_INLINE V inner(V a, V b) {
        return hn::Min(a, b);
    }
    template <class V>
    static HWY_INLINE V outer(V a, V b) {
        return hn::Max(a, b);
    }
};
struct Minimum {
    template <class V>
    static HWY_INLINE V inner(V a, V b) {
        return hn::Max(a, b);
    }
    template <class V>
    static HWY_INLINE V outer(V a, V b) {
        return hn::Min(a, b);
    }
};
template <class Order, class V>
HWY_INLINE V best_run(const V* p) {
    V two[8], four[8];
    for (size_t k = 0; k < 8; ++k) two[k] = Order::inner(p[2 * k + 1], p[(2 * k + 2) % 16]);
    for (size_t k = 0; k < 8; ++k) four[k] = Order::inner(two[k], two[(k + 1) % 8]);
    V best{};
    for (size_t k = 0; k < 8; ++k) {
        const V eight = Order::inner(four[k], four[(k + 2) % 8]);
        const V nine = Order::inner(eight, Order::outer(p[2 * k], p[(2 * k + 9) % 16]));
        best = k == 0 ? nine : Order::outer(best, nine);
    }
    return best;
}

// How far the run is brighter than the centre, or darker: the larger of the two.
template <class V>
HWY_INLINE V difference(V brightest_run, V darkest_run, V centre) {
    return hn::Max(hn::SaturatedSub(brightest_run, centre), hn::SaturatedSub(centre, darkest_run));
}

// Where FAST's circle lies round a pixel.
struct Circle {
    ptrdiff_t offset[16];
    explicit Circle(size_t stride) {
        for (size_t i = 0; i < 16; ++i)
            offset[i] = orb::kCircle[i].y * ptrdiff_t(stride) + orb::kCircle[i].x;
    }
};

// Scores of as many pixels as D has lanes; 0 where they are not above the threshold.
template <class D>
HWY_INLINE hn::Vec<D> scores_at(D d, const uint8_t* pixel, const Circle& circle, uint8_t minimum) {
    using V = hn::Vec<D>;
    const V threshold = hn::Set(d, minimum);
    const auto too_small = [&](V score) {
        return hn::Eq(hn::SaturatedSub(score, threshold), hn::Zero(d));
    };
    const V centre = hn::LoadU(d, pixel);
    V p[16];
    for (size_t i = 0; i < 16; i += 2) p[i] = hn::LoadU(d, pixel + circle.offset[i]);
    // Every run of 9 holds at least one of two opposite pixels.
    V brightest = hn::Max(p[0], p[8]), darkest = hn::Min(p[0], p[8]);
    for (size_t i = 2; i < 8; i += 2) {
        brightest = hn::Min(brightest, hn::Max(p[i], p[i + 8]));
        darkest = hn::Max(darkest, hn::Min(p[i], p[i + 8]));
    }
    if (hn::AllTrue(d, too_small(difference(brightest, darkest, centre)))) return hn::Zero(d);
    for (size_t i = 1; i < 16; i += 2) p[i] = hn::LoadU(d, pixel + circle.offset[i]);
    const V score = difference(best_run<Largest>(p), best_run<Minimum>(p), centre);
    return hn::IfThenZeroElse(too_small(score), score);
}

orb::Offset refine(OrbImage<const uint8_t> image, uint32_t x, uint32_t y) {
    const hn::CappedTag<uint8_t, 16> d;
    const Circle circle(image.stride);
    HWY_ALIGN uint8_t score[3][hn::MaxLanes(d)];
    for (uint32_t row = 0; row < 3; ++row)
        hn::Store(scores_at(d, image.row(y + row - 1) + x - 1, circle, 0), d, score[row]);
    return {orb::peak(score[1][0], score[1][1], score[1][2]),
            orb::peak(score[0][1], score[1][1], score[2][1])};
}

// A cell must fit a vector.
using D8 = hn::ScalableTag<uint8_t>;
using V8 = hn::Vec<D8>;

// Finds usable pixels from rows [0, rows + 6) of the mask, whose row 3 is the band's first: 0 where
// any pixel within 3 cannot be used.
void find_usable(const uint8_t* mask, size_t stride, uint32_t rows, uint8_t* usable) {
    const D8 d;
    const size_t lanes = hn::Lanes(d);
    const uint8_t* across = usable;  // least of 7 pixels beside each other, first for all rows,
                                     // then replaced from above
    for (uint32_t y = 0; y < rows + 6; ++y) {
        const uint8_t* row = mask + y * stride;
        V8 minimum = hn::LoadU(d, row - 3);
        for (ptrdiff_t dx = -2; dx <= 3; ++dx) minimum = hn::Min(minimum, hn::LoadU(d, row + dx));
        hn::Store(minimum, d, usable + y * lanes);
    }
    for (uint32_t y = 0; y < rows; ++y) {
        V8 minimum = hn::Load(d, across + y * lanes);
        for (uint32_t dy = 1; dy < 7; ++dy)
            minimum = hn::Min(minimum, hn::Load(d, across + (y + dy) * lanes));
        hn::Store(minimum, d, usable + y * lanes);
    }
}

// score << 8 | (15 - y) << 4 | (15 - x): the largest is the strongest, then the first in raster
// order.
uint32_t pack_corner(uint32_t key) {
    return key < 256 ? 0 : (key >> 8) << 16 | (15 - (key >> 4 & 15)) << 8 | (15 - (key & 15));
}

void find_corners(const OrbBand& band) {
    const D8 d;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    const uint32_t cells_at_once = lanes / band.cell, step = cells_at_once * band.cell;
    const uint32_t end = band.width - uint32_t(orb::kBorder);
    const Circle circle(band.image.stride);

    HWY_ALIGN uint8_t usable[hn::MaxLanes(d) * (kOrbMaxCell + 6)];
    HWY_ALIGN uint8_t best_of_column[hn::MaxLanes(d)], row_of_column[hn::MaxLanes(d)];
    uint32_t* corner = band.corners;
    for (uint32_t x = uint32_t(orb::kBorder); x < end; x += step) {
        const auto inside = hn::FirstN(d, std::min(end - x, lanes));
        if (band.mask.data != nullptr)
            find_usable(band.mask.row(band.first - 3) + x, band.mask.stride, band.last - band.first,
                        usable);
        V8 best = hn::Zero(d), best_row = hn::Zero(d);
        for (uint32_t y = band.first; y < band.last; ++y) {
            V8 score = hn::IfThenElseZero(
                inside, scores_at(d, band.image.row(y) + x, circle, uint8_t(band.threshold)));
            if (band.mask.data != nullptr)
                score = hn::IfThenZeroElse(
                    hn::Eq(hn::Load(d, usable + (y - band.first) * lanes), hn::Zero(d)), score);
            hn::StoreU(score, d, band.scores.row(y - band.first) + x);
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
                key = std::max(key, uint32_t(best_of_column[lane]) << 8 |
                                        (15u - row_of_column[lane]) << 4 | (15 - i));
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
HWY_EXPORT(refine);
void orb_find_corners(const OrbBand& band) { HWY_DYNAMIC_DISPATCH(find_corners)(band); }

orb::Offset orb_refine(OrbImage<const uint8_t> image, uint32_t x, uint32_t y) {
    return HWY_DYNAMIC_DISPATCH(refine)(image, x, y);
}

}  // namespace defrec::cpu
#endif
