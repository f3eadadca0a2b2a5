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

// 8 results need 10 source pixels and a load of 16.
void shrink(OrbImage<const uint8_t> source, uint32_t source_width, OrbImage<uint8_t> result, uint32_t width,
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
        const auto l = hn::BitCast(d, hn::TableLookupBytesOr0(block, left)),
                   r = hn::BitCast(d, hn::TableLookupBytesOr0(block, right));
        return hn::Add(hn::Mul(l, left_weight), hn::Mul(r, right_weight));
    };

    for (uint32_t y = first; y < last; ++y) {
        const uint32_t phase = y % 4;
        const uint32_t upper_weight = 7 - 2 * phase, lower_weight = 1 + 2 * phase;
        const uint8_t* upper = source.row(y / 4 * 5 + phase);
        const uint8_t* lower = upper + source.stride;
        uint8_t* to = result.row(y);
        const auto vu = hn::Set(d, uint16_t(upper_weight)), vl = hn::Set(d, uint16_t(lower_weight)),
                   round = hn::Set(d, uint16_t{32});
        uint32_t x = 0;
        for (; x + 8 <= width && x / 4 * 5 + 16 <= source_width; x += 8) {
            const uint32_t sx = x / 4 * 5;
            const auto sum =
                hn::Add(hn::Mul(across(upper + sx), vu), hn::Add(hn::Mul(across(lower + sx), vl), round));
            hn::StoreU(
                hn::DemoteTo(half, hn::BitCast(hn::RebindToSigned<decltype(d)>(), hn::ShiftRight<6>(sum))),
                half, to + x);
        }
        for (; x < width; ++x) {
            const uint32_t sx = x / 4 * 5 + x % 4, r = 1 + 2 * (x % 4), l = 8 - r;
            to[x] = uint8_t((upper_weight * (l * upper[sx] + r * upper[sx + 1]) +
                             lower_weight * (l * lower[sx] + r * lower[sx + 1]) + 32) >>
                            6);
        }
    }
}

void smooth(OrbImage<const uint8_t> image, uint32_t width, OrbImage<uint16_t> result, uint32_t first,
            uint32_t last, uint16_t* scratch) {
    const hn::ScalableTag<uint16_t> d;
    const hn::Rebind<uint8_t, decltype(d)> d8;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    const auto weighted = [](auto a, auto b, auto c, auto e, auto f, auto g, auto h) {
        const auto outer = hn::Add(a, h), next = hn::Add(b, g), inner = hn::Add(c, f);
        // 1 2 3 4 3 2 1
        return hn::Add(hn::Add(outer, inner),
                       hn::Add(hn::ShiftLeft<1>(hn::Add(next, inner)), hn::ShiftLeft<2>(e)));
    };
    for (uint32_t y = first; y < last; ++y) {
        const uint8_t* centre = image.row(y);
        const size_t s = image.stride;
        for (uint32_t x = 0;; x = std::min(x + lanes, width - lanes)) {
            const auto at = [&](const uint8_t* p) { return hn::PromoteTo(d, hn::LoadU(d8, p + x)); };
            hn::StoreU(weighted(at(centre - 3 * s), at(centre - 2 * s), at(centre - s), at(centre),
                                at(centre + s), at(centre + 2 * s), at(centre + 3 * s)),
                       d, scratch + x);
            if (x + lanes >= width) break;
        }
        uint16_t* to = result.row(y);
        const uint32_t end = width - 3;
        for (uint32_t x = 3; x < end; x += lanes) {
            const auto at = [&](int32_t dx) { return hn::LoadU(d, scratch + int32_t(x) + dx); };
            const auto sum = weighted(at(-3), at(-2), at(-1), at(0), at(1), at(2), at(3));
            if (x + lanes <= end)
                hn::StoreU(sum, d, to + x);
            else
                hn::BlendedStore(sum, hn::FirstN(d, end - x), d, to + x);
        }
    }
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(shrink);
HWY_EXPORT(smooth);

void orb_shrink(OrbImage<const uint8_t> source, uint32_t source_width, OrbImage<uint8_t> result,
                uint32_t width, uint32_t first, uint32_t last) {
    HWY_DYNAMIC_DISPATCH(shrink)(source, source_width, result, width, first, last);
}

void orb_shrink_mask(OrbImage<const uint8_t> source, OrbImage<uint8_t> result, uint32_t width, uint32_t first,
                     uint32_t last) {
    for (uint32_t y = first; y < last; ++y) {
        const uint8_t* upper = source.row(y / 4 * 5 + y % 4);
        const uint8_t* lower = upper + source.stride;
        uint8_t* to = result.row(y);
        for (uint32_t x = 0, sx = 0; x < width; ++x, sx += x % 4 == 0 ? 2 : 1)
            to[x] = upper[sx] && upper[sx + 1] && lower[sx] && lower[sx + 1] ? 255 : 0;
    }
}

void orb_smooth(OrbImage<const uint8_t> image, uint32_t width, OrbImage<uint16_t> result, uint32_t first,
                uint32_t last, uint16_t* scratch) {
    HWY_DYNAMIC_DISPATCH(smooth)(image, width, result, first, last, scratch);
}

}  // namespace defrec::cpu
#endif
