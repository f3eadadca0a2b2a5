// Orientation and descriptor of one feature for the stage orb.
#include <algorithm>

#include "backends/cpu/orb_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/orb_describe.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

#ifndef DEFREC_CPU_ORB_DISC
#define DEFREC_CPU_ORB_DISC
namespace defrec::cpu {

// 255 inside the disc, 0 outside; row y and its mirror image share one. Column 15 is the centre,
// column 31 is outside.
struct OrbDisc {
    alignas(64) uint8_t row[orb::kPatchRadius + 1][32];
};
constexpr OrbDisc kDisc = [] {
    OrbDisc disc{};
    for (int32_t y = 0; y <= orb::kPatchRadius; ++y)
        for (int32_t x = -orb::kPatchRadius; x <= orb::kPatchRadius; ++x) {
            const int32_t half = orb::kDiscHalfWidth[size_t(y)];
            disc.row[y][x + orb::kPatchRadius] = x >= -half && x <= half ? 255 : 0;
        }
    return disc;
}();

}  // namespace defrec::cpu
#endif

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Sums of a column stay below 2^13, those of y times difference below 2^15, so 16 bits hold both
// until the end.
uint32_t orientation(OrbImage<const uint8_t> image, uint32_t x, uint32_t y) {
    const hn::CappedTag<int16_t, 32> d;
    const hn::Rebind<uint8_t, decltype(d)> d8;
    const hn::RepartitionToWide<decltype(d)> d32;
    const uint8_t* centre = image.row(y) + x;
    auto mx = hn::Zero(d32), my = hn::Zero(d32);
    for (size_t column = 0; column < 32; column += hn::Lanes(d)) {
        const auto at = [&](ptrdiff_t dy) {
            const uint8_t* pixels =
                centre + dy * ptrdiff_t(image.stride) - orb::kPatchRadius + ptrdiff_t(column);
            const auto disc = hn::LoadU(d8, kDisc.row[dy < 0 ? -dy : dy] + column);
            return hn::PromoteTo(d, hn::And(hn::LoadU(d8, pixels), disc));
        };
        auto sum = at(0), turning = hn::Zero(d);
        for (ptrdiff_t dy = 1; dy <= orb::kPatchRadius; ++dy) {
            const auto below = at(dy), above = at(-dy);
            sum = hn::Add(sum, hn::Add(below, above));
            turning = hn::Add(turning, hn::Mul(hn::Sub(below, above), hn::Set(d, int16_t(dy))));
        }
        // Highway's Iota of a variable goes through memory, lane by lane.
        const auto lever =
            hn::Add(hn::Iota(d, 0), hn::Set(d, int16_t(int16_t(column) - orb::kPatchRadius)));
        auto odd = hn::Zero(d32);
        mx = hn::ReorderWidenMulAccumulate(d32, sum, lever, mx, odd);
        mx = hn::Add(mx, odd);
        odd = hn::Zero(d32);
        my = hn::ReorderWidenMulAccumulate(d32, turning, hn::Set(d, int16_t{1}), my, odd);
        my = hn::Add(my, odd);
    }
    return orb::angle_bin(hn::GetLane(hn::SumOfLanes(d32, mx)),
                          hn::GetLane(hn::SumOfLanes(d32, my)));
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(orientation);

uint32_t orb_orientation(OrbImage<const uint8_t> image, uint32_t x, uint32_t y) {
    return HWY_DYNAMIC_DISPATCH(orientation)(image, x, y);
}

// Not vectors: a gather takes longer than the loads it stands for on every processor it was tried
// on.
void orb_describe(const uint16_t* patch, const OrbOffsets& offsets, uint32_t* descriptor) {
    for (size_t word = 0; word < orb::kTests / 32; ++word) {
        const OrbOffsets::Test* test = &offsets.test[32 * word];
        uint32_t bits = 0;
        for (size_t bit = 32; bit-- > 0;)
            bits = 2 * bits + (patch[test[bit].first] < patch[test[bit].second] ? 1u : 0u);
        descriptor[word] = bits;
    }
}

}  // namespace defrec::cpu
#endif
