// Gray copies are those of the definition, of any length, at any place.
#include "sdk/tracking/frame/gray_copy.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "backends/shared/gray.hpp"
#include "include/defrec_c.h"
#include "sdk/contract/pixel_format.hpp"

namespace {

using namespace defrec;

int expected_gray(uint32_t format, const uint8_t* pixel) {
    switch (format) {
        case DEFREC_FORMAT_GRAY8:
            return pixel[0];
        case DEFREC_FORMAT_RGB8:
            return gray_of(pixel[0], pixel[1], pixel[2]);
        default:
            return gray_of(pixel[2], pixel[1], pixel[0]);
    }
}

}  // namespace

TEST_CASE("colours are copied as their gray values, and nothing beside them is written") {
    constexpr uint8_t kUntouched = 77;
    constexpr size_t kBefore = 5;
    for (const uint32_t format :
         {DEFREC_FORMAT_GRAY8, DEFREC_FORMAT_BGR8, DEFREC_FORMAT_RGB8, DEFREC_FORMAT_BGRA8})
        for (const bool streams : {false, true})
            for (const size_t pixels : {0u, 1u, 15u, 16u, 17u, 48u, 1000u}) {
                CAPTURE(format);
                CAPTURE(streams);
                CAPTURE(pixels);
                const size_t bytes = bytes_per_pixel(format);
                std::vector<uint8_t> from(bytes * pixels);  // no byte more, for AddressSanitizer
                for (size_t i = 0; i < from.size(); ++i)
                    from[i] = static_cast<uint8_t>(i * 2654435761u >> 21);
                for (size_t i = 0; i < std::min<size_t>(from.size(), bytes); ++i) from[i] = 255;
                std::vector<uint8_t> to(pixels + 2 * kBefore, kUntouched);
                copy_gray(format, from.data(), pixels, to.data() + kBefore, streams);
                size_t wrong = 0;
                for (size_t i = 0; i < pixels; ++i)
                    wrong += to[kBefore + i] != expected_gray(format, from.data() + bytes * i);
                for (size_t i = 0; i < kBefore; ++i)
                    wrong += to[i] != kUntouched || to[kBefore + pixels + i] != kUntouched;
                CHECK(wrong == 0);
            }
}
