// Small formulas of the stage orb (docs/stages/orb.md) that every backend shares: circles, angles,
// positions.
#pragma once
#include <array>
#include <cstdint>

#include "backends/shared/orb_pattern.hpp"
#include "backends/stages/orb.hpp"

namespace defrec::orb {

// Bin of the direction (x, y), 0 for (0, 0); |x|, |y| < 2^20.
constexpr uint32_t angle_bin(int32_t x, int32_t y) {
    constexpr Offset kBinBorder[8] = DEFREC_ORB_BIN_BORDERS;
    const int32_t ax = x < 0 ? -x : x, ay = y < 0 ? -y : y;
    uint32_t k = 0;
    for (const Offset& border : kBinBorder) k += ay * border.x > ax * border.y ? 1u : 0u;
    if (x < 0) k = kBins / 2 - k;
    return y < 0 ? (kBins - k) % kBins : k;
}

// Where the corner score peaks between pixels, 1/16 px from the middle one, -7 to 7: the vertex of
// the parabola through the scores of three neighbours.
constexpr int32_t peak(int32_t before, int32_t middle, int32_t after) {
    const int32_t curvature = 2 * middle - before - after, slope = 8 * (after - before);
    if (curvature <= 0) return 0;
    if (slope >= 7 * curvature) return 7;
    if (slope <= -7 * curvature) return -7;
    return (2 * slope + 33 * curvature) / (2 * curvature) - 16;  // rounded to nearest
}

// A coordinate of a level, 1/16 px, in the image, 1/16 px.
constexpr int32_t to_image(uint32_t sixteenths, uint32_t level, uint32_t halvings) {
    uint32_t five = 1;
    for (uint32_t l = 0; l < level; ++l) five *= 5;
    const uint32_t half = level == 0 ? 0 : 1u << (2 * level - 1);
    return int32_t((((sixteenths + 8) * five << halvings) + half) >> (2 * level)) - 8;
}
// A level is (4/5)^level / 2^halvings times as large as the image, so that what is shifted is less
// than this, whatever the halvings.
static_assert((uint64_t{16 * DEFREC_MAX_SIDE + 1} << 2 * (kOrbMaxLevels - 1)) <= UINT32_MAX);

// The 512 points of the test pattern turned by one orientation bin: test i compares points 2i and
// 2i + 1.
using Pattern = std::array<Offset, 2 * kTests>;
inline Pattern turned_pattern(uint32_t bin) {
    // round(16384 * cos) of k * 11.25 degrees
    constexpr int32_t kCosine[9] = {16384, 16069, 15137, 13623, 11585, 9102, 6270, 3196, 0};
    const auto cosine = [&](uint32_t k) {
        k %= kBins;
        if (k > kBins / 2) k = kBins - k;
        return k <= kBins / 4 ? kCosine[k] : -kCosine[kBins / 2 - k];
    };
    const int32_t c = cosine(bin), s = cosine(bin + kBins * 3 / 4);
    Pattern turned;
    for (size_t i = 0; i < turned.size(); ++i) {
        const int32_t x = kPattern[i][0], y = kPattern[i][1];
        turned[i] = {(c * x - s * y + 8192) >> 14, (s * x + c * y + 8192) >> 14};
    }
    return turned;
}

}  // namespace defrec::orb
