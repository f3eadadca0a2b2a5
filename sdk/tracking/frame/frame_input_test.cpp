// Pixels of the host are copied whole, as gray values, whoever helps.
#include "sdk/tracking/frame/frame_input.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "backends/shared/gray.hpp"
#include "sdk/base/os/services.hpp"
#include "sdk/base/os/shared_loop.hpp"

namespace {

using namespace defrec;

constexpr uint32_t kHeight = 701;
constexpr uint64_t kWidth = 800, kRow = 3 * kWidth, kStride = 2500;

void check_kept(const Services* helpers, bool with_ignore) {
    std::vector<uint8_t> left(kStride * kHeight), right(left.size()), ignore(kWidth * kHeight);
    for (size_t i = 0; i < left.size(); ++i) {
        left[i] = static_cast<uint8_t>(i * 2654435761u >> 24);
        right[i] = static_cast<uint8_t>(left[i] + 1);
    }
    for (size_t i = 0; i < ignore.size(); ++i) ignore[i] = static_cast<uint8_t>(i / kWidth);
    FrameImage images[3];
    images[0].pixels = left.data();
    images[1].pixels = right.data();
    images[0].stride = images[1].stride = kStride;
    if (with_ignore) images[2].pixels = ignore.data();
    images[2].stride = kWidth;
    std::vector<uint8_t> copies[3];
    for (std::vector<uint8_t>& copy : copies) copy.resize(kWidth * kHeight);
    const KeptImage kept[] = {{images[0], DEFREC_FORMAT_BGR8, kWidth, copies[0]},
                              {images[1], DEFREC_FORMAT_BGR8, kWidth, copies[1]},
                              {images[2], DEFREC_FORMAT_GRAY8, kWidth, copies[2]}};
    SharedLoop loop;
    keep_pixels(kept, kHeight, loop, helpers, true);
    CHECK(images[0].pixels == copies[0].data());
    CHECK(images[1].stride == kWidth);
    size_t wrong = 0;
    const auto is_wrong = [](const std::vector<uint8_t>& copy, const std::vector<uint8_t>& given,
                             size_t x, size_t y) {
        const uint8_t* pixel = &given[y * kStride + 3 * x];
        return copy[y * kWidth + x] != gray_of(pixel[2], pixel[1], pixel[0]);
    };
    for (size_t y = 0; y < kHeight; ++y)
        for (size_t x = 0; x < kWidth; ++x)
            wrong += is_wrong(copies[0], left, x, y) || is_wrong(copies[1], right, x, y);
    CHECK(wrong == 0);
    CHECK((images[2].pixels == copies[2].data()) == with_ignore);
    CHECK(copies[2] == (with_ignore ? ignore : std::vector<uint8_t>(ignore.size())));
}

}  // namespace

TEST_CASE("pixels are kept without padding, by one thread or several") {
    defrec_context_desc desc{};
    desc.threads = 3;
    const Services services(desc);
    for (const bool with_ignore : {false, true}) {
        check_kept(nullptr, with_ignore);
        check_kept(&services, with_ignore);
    }
}

TEST_CASE(
    "an application's parallel_for that leaves bands out is noticed, and the images stay the "
    "application's") {
    defrec_context_desc desc{};
    desc.parallel_for = [](void*, size_t count, void (*body)(void*, size_t), void* arg) {
        for (size_t i = 1; i < count; ++i) body(arg, i);
    };
    const Services services(desc);
    std::vector<uint8_t> pixels(kRow * kHeight), copy(pixels.size());
    FrameImage image;
    image.pixels = pixels.data();
    image.stride = kRow;
    const KeptImage kept[] = {{image, DEFREC_FORMAT_GRAY8, kRow, copy}};
    SharedLoop loop;
    CHECK_THROWS(keep_pixels(kept, kHeight, loop, &services, true));
    CHECK(image.pixels == pixels.data());
}
