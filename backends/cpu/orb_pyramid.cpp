// Resampling and smoothing for the stage orb.
#include <algorithm>

#include "backends/cpu/orb_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/orb_pyramid.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// 8 results come from 10 pixels of one load of 16.
void shrink(OrbImage<const uint8_t> source, OrbImage<uint8_t> result, uint32_t width,
            uint32_t first, uint32_t last) {
    const hn::Full128<uint16_t> d;
    const hn::Full128<uint8_t> d8;
    const hn::Half<decltype(d8)> half;
    alignas(16) static constexpr uint8_t kLeft[16] = {0, 128, 1, 128, 2, 128, 3, 128,
                                                      5, 128, 6, 128, 7, 128, 8, 128};
    alignas(16) static constexpr uint8_t kRight[16] = {1, 128, 2, 128, 3, 128, 4, 128,
                                                       6, 128, 7, 128, 8, 128, 9, 128};
    alignas(16) static constexpr uint16_t kLeftWeight[8] = {7, 5, 3, 1, 7, 5, 3, 1};
    const auto left = hn::Load(d8, kLeft), right = hn::Load(d8, kRight);
    const auto left_weight = hn::Load(d, kLeftWeight),
               right_weight = hn::Sub(hn::Set(d, uint16_t{8}), left_weight);
    const auto across = [&](const uint8_t* pixels) {
        const auto block = hn::LoadU(d8, pixels);
        const auto l = hn::BitCast(d, hn::TableLookupBytesOr0(block, left));
        const auto r = hn::BitCast(d, hn::TableLookupBytesOr0(block, right));
        return hn::Add(hn::Mul(l, left_weight), hn::Mul(r, right_weight));
    };
    for (uint32_t y = first; y < last; ++y) {
        const uint32_t phase = y % 4;
        const uint8_t* upper = source.row(y / 4 * 5 + phase);
        const uint8_t* lower = upper + source.stride;
        const auto upper_weight = hn::Set(d, uint16_t(7 - 2 * phase)),
                   lower_weight = hn::Set(d, uint16_t(1 + 2 * phase));
        for (uint32_t x = 0, sx = 0; x < width; x += 8, sx += 10) {
            const auto down = hn::Add(hn::Mul(across(upper + sx), upper_weight),
                                      hn::Mul(across(lower + sx), lower_weight));
            const auto mean = hn::ShiftRight<6>(hn::Add(down, hn::Set(d, uint16_t{32})));
            hn::StoreU(hn::DemoteTo(half, hn::BitCast(hn::RebindToSigned<decltype(d)>(), mean)),
                       half, result.row(y) + x);
        }
    }
}

// 12 results come from 15 pixels of one load of 16; any value but 0 is usable.
void shrink_mask(OrbImage<const uint8_t> source, OrbImage<uint8_t> result, uint32_t width,
                 uint32_t first, uint32_t last) {
    const hn::Full128<uint8_t> d;
    alignas(16) static constexpr uint8_t kLeft[16] = {0, 1, 2, 3, 5, 6, 7, 8, 10, 11, 12, 13};
    const auto left = hn::Load(d, kLeft), right = hn::Add(left, hn::Set(d, uint8_t{1}));
    for (uint32_t y = first; y < last; ++y) {
        const uint8_t* upper = source.row(y / 4 * 5 + y % 4);
        const uint8_t* lower = upper + source.stride;
        for (uint32_t x = 0, sx = 0; x < width; x += 12, sx += 15) {
            const auto down = hn::Min(hn::LoadU(d, upper + sx), hn::LoadU(d, lower + sx));
            hn::StoreU(hn::Min(hn::TableLookupBytes(down, left), hn::TableLookupBytes(down, right)),
                       d, result.row(y) + x);
        }
    }
}

void soften(OrbImage<const uint8_t> gray, uint32_t width, uint32_t height, OrbImage<uint8_t> result,
            uint32_t first, uint32_t last, uint16_t* scratch) {
    const hn::ScalableTag<uint16_t> d;
    const hn::Rebind<uint8_t, decltype(d)> d8;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    uint16_t* down = scratch + kOrbSlack / 2;
    for (uint32_t y = first; y < last; ++y) {
        const uint8_t* rows[3] = {gray.row(y == 0 ? 0 : y - 1), gray.row(y),
                                  gray.row(std::min(y + 1, height - 1))};
        for (uint32_t x = 0;; x = std::min(x + lanes, width - lanes)) {
            const auto at = [&](const uint8_t* p) {
                return hn::PromoteTo(d, hn::LoadU(d8, p + x));
            };
            const auto centre = at(rows[1]);
            hn::StoreU(hn::Add(hn::Add(at(rows[0]), at(rows[2])), hn::Add(centre, centre)), d,
                       down + x);
            if (x + lanes >= width) break;
        }
        down[-1] = down[0];
        down[width] = down[width - 1];
        for (uint32_t x = 0; x < width; x += lanes) {
            const auto centre = hn::LoadU(d, down + x),
                       sides = hn::Add(hn::LoadU(d, down + x - 1), hn::LoadU(d, down + x + 1));
            const auto sum =
                hn::Add(hn::Add(sides, hn::Add(centre, centre)), hn::Set(d, uint16_t{8}));
            const auto mean =
                hn::BitCast(hn::RebindToSigned<decltype(d)>(), hn::ShiftRight<4>(sum));
            hn::StoreU(hn::DemoteTo(d8, mean), d8, result.row(y) + x);
        }
    }
}

// a + 4 b + 6 c + 4 e + f, in the order of the window.
template <class V>
HWY_INLINE V binomial(V a, V b, V c, V e, V f) {
    const V near = hn::Add(hn::Add(b, e), c);
    return hn::Add(hn::Add(a, f), hn::Add(hn::ShiftLeft<2>(near), hn::Add(c, c)));
}

void smooth(OrbImage<const uint8_t> image, uint32_t width, OrbImage<uint16_t> result,
            uint32_t first, uint32_t last, uint16_t* scratch) {
    const hn::ScalableTag<uint16_t> d;
    const hn::Rebind<uint8_t, decltype(d)> d8;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    for (uint32_t y = first; y < last; ++y) {
        const uint8_t* centre = image.row(y);
        const size_t s = image.stride;
        for (uint32_t x = 0; x < width; x += lanes) {
            const auto at = [&](const uint8_t* p) {
                return hn::PromoteTo(d, hn::LoadU(d8, p + x));
            };
            hn::StoreU(binomial(at(centre - 2 * s), at(centre - s), at(centre), at(centre + s),
                                at(centre + 2 * s)),
                       d, scratch + x);
        }
        uint16_t* to = result.row(y);
        const uint32_t end = width - 2;
        for (uint32_t x = 2; x < end; x += lanes) {
            const auto at = [&](int32_t dx) { return hn::LoadU(d, scratch + int32_t(x) + dx); };
            const auto sum = binomial(at(-2), at(-1), at(0), at(1), at(2));
            if (x + lanes <= end)
                hn::StoreU(sum, d, to + x);
            else
                hn::BlendedStore(sum, hn::FirstN(d, end - x), d, to + x);
        }
    }
}

void smooth_patch(OrbImage<const uint8_t> image, uint32_t x, uint32_t y, uint16_t* patch) {
    const hn::CappedTag<uint16_t, size_t(kOrbPatchSide)> d;
    const hn::Rebind<uint8_t, decltype(d)> d8;
    constexpr int32_t kReach = orb::kPatchRadius + orb::kSmoothRadius;
    for (size_t column = 0; column < size_t(kOrbPatchSide); column += hn::Lanes(d)) {
        const uint8_t* row = image.row(y - uint32_t(kReach)) + x - kReach + column;
        const auto across = [&] {
            const auto at = [&](size_t dx) { return hn::PromoteTo(d, hn::LoadU(d8, row + dx)); };
            const auto sum = binomial(at(0), at(1), at(2), at(3), at(4));
            row += image.stride;
            return sum;
        };
        auto a = across(), b = across(), c = across(), e = across();
        for (int32_t line = 0; line <= 2 * orb::kPatchRadius; ++line) {
            const auto f = across();
            hn::Store(binomial(a, b, c, e, f), d, patch + size_t(line * kOrbPatchSide) + column);
            a = b;
            b = c;
            c = e;
            e = f;
        }
    }
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(soften);
HWY_EXPORT(shrink);
HWY_EXPORT(shrink_mask);
HWY_EXPORT(smooth);
HWY_EXPORT(smooth_patch);

void orb_soften(OrbImage<const uint8_t> gray, uint32_t width, uint32_t height,
                OrbImage<uint8_t> result, uint32_t first, uint32_t last, uint16_t* scratch) {
    HWY_DYNAMIC_DISPATCH(soften)(gray, width, height, result, first, last, scratch);
}

void orb_shrink(OrbImage<const uint8_t> source, OrbImage<uint8_t> result, uint32_t width,
                uint32_t first, uint32_t last) {
    HWY_DYNAMIC_DISPATCH(shrink)(source, result, width, first, last);
}

void orb_shrink_mask(OrbImage<const uint8_t> source, OrbImage<uint8_t> result, uint32_t width,
                     uint32_t first, uint32_t last) {
    HWY_DYNAMIC_DISPATCH(shrink_mask)(source, result, width, first, last);
}

void orb_smooth(OrbImage<const uint8_t> image, uint32_t width, OrbImage<uint16_t> result,
                uint32_t first, uint32_t last, uint16_t* scratch) {
    HWY_DYNAMIC_DISPATCH(smooth)(image, width, result, first, last, scratch);
}

void orb_smooth_patch(OrbImage<const uint8_t> image, uint32_t x, uint32_t y, uint16_t* patch) {
    HWY_DYNAMIC_DISPATCH(smooth_patch)(image, x, y, patch);
}

}  // namespace defrec::cpu
#endif
