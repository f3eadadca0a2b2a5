// A field's picture is made of the field's rows alone, whoever copies which part of it.
#include "sdk/tracking/frame/field_copy.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/base/os/services.hpp"
#include "sdk/base/os/shared_loop.hpp"
#include "sdk/tracking/frame/frame_input.hpp"

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 64;

uint8_t gray_at(uint32_t x, uint32_t y) { return static_cast<uint8_t>(x + 3 * y + x * y % 7); }

// The field's rows; `other` in those of the other field.
std::vector<uint8_t> image_with(uint32_t height, bool is_bottom, uint8_t other) {
    std::vector<uint8_t> pixels(size_t{kWidth} * height, other);
    for (uint32_t y = is_bottom ? 1 : 0; y < height; y += 2)
        for (uint32_t x = 0; x < kWidth; ++x) pixels[y * kWidth + x] = gray_at(x, y);
    return pixels;
}

std::vector<uint8_t> picture_of(const std::vector<uint8_t>& pixels, bool is_bottom,
                                const std::vector<size_t>& cuts) {
    const auto height = static_cast<uint32_t>(pixels.size() / kWidth);
    const RawImage image{DEFREC_FORMAT_GRAY8, pixels.data(), kWidth, kWidth, height};
    std::vector<uint8_t> picture(pixels.size());
    for (size_t i = 0; i + 1 < cuts.size(); ++i)
        copy_field(image, is_bottom, {cuts[i], cuts[i + 1]}, &picture[cuts[i] * kWidth],
                   i % 2 == 1);
    return picture;
}

}  // namespace

TEST_CASE("a field's rows stay where they are, and the others lie between them") {
    for (const bool is_bottom : {false, true}) {
        const std::vector<uint8_t> given = image_with(49, is_bottom, 0),
                                   picture = picture_of(given, is_bottom, {0, 49});
        const auto at = [&](const std::vector<uint8_t>& image, uint32_t x, uint32_t y) {
            return int{image[y * kWidth + x]};
        };
        const uint32_t first = is_bottom ? 1 : 0, last = is_bottom ? 47 : 48;
        size_t wrong = 0;
        for (uint32_t y = 0; y < 49; ++y)
            for (uint32_t x = 0; x < kWidth; ++x) {
                const int above = at(given, x, std::max(y, first + 1) - 1),
                          below = at(given, x, std::min(y + 1, last));
                const int expected = y % 2 == first ? at(given, x, y)
                                     : y < first    ? below
                                     : y > last     ? above
                                                    : (above + below + 1) / 2;
                wrong += at(picture, x, y) != expected;
            }
        CHECK(wrong == 0);
    }
}

TEST_CASE("rows of the other field are not read, and parts make the same picture") {
    for (const bool is_bottom : {false, true}) {
        const std::vector<uint8_t> whole =
            picture_of(image_with(50, is_bottom, 0), is_bottom, {0, 50});
        CHECK(whole == picture_of(image_with(50, is_bottom, 255), is_bottom, {0, 50}));
        CHECK(whole == picture_of(image_with(50, is_bottom, 9), is_bottom, {0, 1, 7, 20, 49, 50}));
    }
}

TEST_CASE("a frame's views are kept as pictures of its field, and what is not tissue as it is") {
    constexpr uint32_t kHeight = 701;
    defrec_context_desc desc{};
    desc.threads = 3;
    const Services services(desc);
    const std::vector<uint8_t> pixels = image_with(kHeight, true, 200);
    std::vector<uint8_t> copies[2];
    for (std::vector<uint8_t>& copy : copies) copy.resize(pixels.size());
    FrameImage view, ignore;
    view.pixels = ignore.pixels = pixels.data();
    view.stride = ignore.stride = kWidth;
    const KeptImage kept[] = {
        {view, DEFREC_FORMAT_GRAY8, kWidth, copies[0], nullptr, DEFREC_FIELD_BOTTOM},
        {ignore, DEFREC_FORMAT_GRAY8, kWidth, copies[1]}};
    SharedLoop loop;
    keep_pixels(kept, kHeight, loop, &services, true);
    CHECK(copies[0] == picture_of(pixels, true, {0, kHeight}));
    CHECK(copies[1] == pixels);
}
