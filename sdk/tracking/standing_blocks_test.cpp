#include "sdk/tracking/standing_blocks.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 128, kHeight = 96;

// Texture that is another one in each frame.
std::vector<uint8_t> image(uint32_t frame) {
    std::vector<uint8_t> gray(size_t{kWidth} * kHeight);
    uint32_t state = 77 + frame;
    for (uint8_t& pixel : gray) {
        state = state * 1664525 + 1013904223;
        pixel = static_cast<uint8_t>(100 + (state >> 27));
    }
    return gray;
}

// The left half as in another frame.
std::vector<uint8_t> left_half_of(const std::vector<uint8_t>& other, std::vector<uint8_t> gray) {
    for (uint32_t y = 0; y < kHeight; ++y)
        std::copy_n(&other[size_t{y} * kWidth], kWidth / 2, &gray[size_t{y} * kWidth]);
    return gray;
}

}  // namespace

TEST_CASE("blocks stand where they are, bit for bit, as in the frame before") {
    StandingBlocks blocks(kWidth, kHeight);
    const std::vector<uint8_t> first = image(0), second = image(1);
    blocks.add_image(first.data());
    CHECK(blocks.share() == 0);  // there is none before
    blocks.add_image(first.data());
    CHECK(blocks.share() == 1);
    blocks.add_image(second.data());
    CHECK(blocks.share() == 0);
    blocks.add_image(left_half_of(second, image(2)).data());
    CHECK(blocks.share() == doctest::Approx(0.5));
    CHECK(blocks.stands(10, 50));
    CHECK(!blocks.stands(70, 50));
    CHECK(blocks.stands(-1000, -1000));  // that of the nearest pixel
    CHECK(!blocks.stands(1e9, 1e9));
}

TEST_CASE("images without texture stand nowhere") {
    StandingBlocks blocks(kWidth, kHeight);
    const std::vector<uint8_t> flat(size_t{kWidth} * kHeight, uint8_t{90});
    blocks.add_image(flat.data());
    blocks.add_image(flat.data());
    CHECK(blocks.share() == 0);
    CHECK(!blocks.any());
}

TEST_CASE("a block is stale once half a pixel of motion was seen elsewhere while it stood") {
    StandingBlocks blocks(kWidth, kHeight);
    const std::vector<uint8_t> first = image(0);
    const auto next = [&](uint32_t frame, double motion) {
        blocks.add_image(left_half_of(first, image(frame)).data());
        blocks.others_moved(motion);
    };
    next(1, 5);
    CHECK(!blocks.is_stale(10, 50));  // it is new
    next(2, 0.3);
    CHECK(blocks.stands(10, 50));
    CHECK(!blocks.is_stale(10, 50));
    next(3, 0.3);
    CHECK(blocks.is_stale(10, 50));
    CHECK(!blocks.is_stale(70, 50));
    blocks.add_image(image(4).data());
    CHECK(!blocks.is_stale(10, 50));
    blocks.add_image(image(4).data());
    CHECK(!blocks.is_stale(10, 50));  // what was seen before it stood does not count
}
