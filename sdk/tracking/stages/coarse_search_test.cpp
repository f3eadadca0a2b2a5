#include "sdk/tracking/stages/coarse_search.hpp"

#include <doctest/doctest.h>

#include <cstddef>
#include <optional>
#include <random>
#include <vector>

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 640, kHeight = 180;

// A right view of blocks of 8 px of random gray, and the left one that is `near` px nearer in its
// left half and `far` px in its right.
struct Pair {
    std::vector<uint8_t> gray[2], mask[2];

    Pair(uint32_t near, uint32_t far) {
        std::mt19937 random(7);
        std::vector<uint8_t> block(size_t{2 * kWidth / 8} * (kHeight / 8 + 1));
        for (uint8_t& gray_level : block) gray_level = static_cast<uint8_t>(40 + random() % 160);
        const auto texture = [&](uint32_t x, uint32_t y) {
            return block[y / 8 * (2 * kWidth / 8) + x / 8];
        };
        for (int view = 0; view < 2; ++view) {
            gray[view].resize(size_t{kWidth} * kHeight);
            mask[view].assign(gray[view].size(), 255);
            for (uint32_t y = 0; y < kHeight; ++y)
                for (uint32_t x = 0; x < kWidth; ++x) {
                    const uint32_t shift = view == 1 ? 0 : x < kWidth / 2 ? near : far;
                    gray[view][size_t{y} * kWidth + x] = texture(kWidth / 2 + x - shift, y);
                }
        }
    }
    std::optional<SeenDisparities> search(uint32_t max) const {
        return coarse_search({kWidth, kHeight, {gray[0], gray[1]}, {mask[0], mask[1]}}, max);
    }
};

}  // namespace

TEST_CASE("the coarse search sees the disparities of most of the view, within its steps") {
    const std::optional<SeenDisparities> both = Pair(72, 120).search(288);
    REQUIRE(both);
    CHECK(both->min == doctest::Approx(72).epsilon(0.06));
    CHECK(both->max == doctest::Approx(120).epsilon(0.06));
    const std::optional<SeenDisparities> one = Pair(240, 240).search(288);
    REQUIRE(one);
    CHECK(one->min >= 232);
    CHECK(one->max <= 248);
}

TEST_CASE("the coarse search sees nothing beyond its end, behind a mask or without texture") {
    CHECK_FALSE(Pair(240, 240).search(200));
    Pair masked(72, 72);
    masked.mask[1].assign(masked.mask[1].size(), 0);
    CHECK_FALSE(masked.search(288));
    Pair flat(72, 72);
    for (std::vector<uint8_t>& gray : flat.gray) gray.assign(gray.size(), 128);
    CHECK_FALSE(flat.search(288));
}
