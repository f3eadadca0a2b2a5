#include "sdk/tracking/monitors/frozen_regions.hpp"

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

void add_image(FrozenRegions& blocks, const std::vector<uint8_t>& gray) {
    for (size_t part = 0; part < FrozenRegions::kParts; ++part) blocks.add_part(gray.data(), part);
    blocks.end_image();
}

// The left half as in another frame.
std::vector<uint8_t> left_half_of(const std::vector<uint8_t>& other, std::vector<uint8_t> gray) {
    for (uint32_t y = 0; y < kHeight; ++y)
        std::copy_n(&other[size_t{y} * kWidth], kWidth / 2, &gray[size_t{y} * kWidth]);
    return gray;
}

}  // namespace

TEST_CASE("blocks stand where they are, bit for bit, as in the frame before") {
    FrozenRegions blocks(kWidth, kHeight);
    const std::vector<uint8_t> first = image(0), second = image(1);
    add_image(blocks, first);
    CHECK(blocks.share() == 0);  // there is none before
    add_image(blocks, first);
    CHECK(blocks.share() == 1);
    add_image(blocks, second);
    CHECK(blocks.share() == 0);
    add_image(blocks, left_half_of(second, image(2)));
    CHECK(blocks.share() == doctest::Approx(0.5));
    CHECK(blocks.is_frozen(10, 50));
    CHECK(!blocks.is_frozen(70, 50));
    CHECK(blocks.is_frozen(-1000, -1000));  // that of the nearest pixel
    CHECK(!blocks.is_frozen(1e9, 1e9));
}

TEST_CASE("images without texture stand nowhere") {
    FrozenRegions blocks(kWidth, kHeight);
    const std::vector<uint8_t> flat(size_t{kWidth} * kHeight, uint8_t{90});
    add_image(blocks, flat);
    add_image(blocks, flat);
    CHECK(blocks.share() == 0);
    CHECK(!blocks.any());
}

TEST_CASE("a block is stale once half a pixel of motion was seen elsewhere while it stood") {
    FrozenRegions blocks(kWidth, kHeight);
    const std::vector<uint8_t> first = image(0);
    const auto next = [&](uint32_t frame, double motion) {
        add_image(blocks, left_half_of(first, image(frame)));
        blocks.others_moved(motion);
    };
    next(1, 5);
    CHECK(!blocks.is_stale(10, 50));  // it is new
    next(2, 0.3);
    CHECK(blocks.is_frozen(10, 50));
    CHECK(!blocks.is_stale(10, 50));
    next(3, 0.3);
    CHECK(blocks.is_stale(10, 50));
    CHECK(!blocks.is_stale(70, 50));
    add_image(blocks, image(4));
    CHECK(!blocks.is_stale(10, 50));
    add_image(blocks, image(4));
    CHECK(!blocks.is_stale(10, 50));  // what was seen before it stood does not count
}

TEST_CASE("the parts of an image are all its rows, one after the other, however few") {
    for (const uint32_t height : {20u, 64u, 96u, 540u}) {
        CAPTURE(height);
        const FrozenRegions blocks(kWidth, height);
        uint32_t row = 0;
        for (size_t part = 0; part < FrozenRegions::kParts; ++part) {
            const RowRange rows = blocks.rows_of(part);
            CHECK(rows.first == row);
            row = rows.last;
        }
        CHECK(row == height);
    }
}
