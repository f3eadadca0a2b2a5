#include "sdk/base/util/image.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <string>

#include "sdk/base/util/error.hpp"

using namespace defrec;

namespace {

unsigned char pixels[64 * 48 * 4];

defrec_image good() {
    defrec_image image;
    DEFREC_INIT(&image);
    image.format = DEFREC_FORMAT_BGR8;
    image.width = 64;
    image.height = 48;
    image.pixels = pixels;
    return image;
}

std::string refusal(const std::function<void(defrec_image&)>& change,
                    defrec_status status = DEFREC_ERROR_ARGUMENT) {
    defrec_image image = good();
    change(image);
    try {
        read_image("left", &image);
    } catch (const Error& error) {
        CHECK(error.status() == status);
        return error.what();
    }
    return "";
}
bool contains(const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("an image is accepted and its stride filled in") {
    const defrec_image given = good();
    const defrec_image image = read_image("left", &given);
    CHECK(image.stride == 192);
    CHECK(image_bytes(image) == 192 * 48);
    CHECK(refusal([](auto& i) { i.stride = 200; }) == "");
}

TEST_CASE("row 16: NULL image and NULL pixels") {
    CHECK_THROWS_AS(read_image("left", nullptr), Error);
    CHECK(contains(refusal([](auto& i) { i.pixels = nullptr; }), "left: pixels is NULL"));
}

TEST_CASE("an image in memory has no pixels, and keeps a stride of 0") {
    const auto memory = reinterpret_cast<defrec_memory>(uintptr_t{1});
    defrec_image given = good();
    given.pixels = nullptr;
    given.memory = memory;
    CHECK(read_image("left", &given).stride == 0);
    CHECK(contains(refusal([&](auto& i) { i.memory = memory; }),
                   "left: both pixels and memory are given"));
    CHECK(contains(refusal([&](auto& i) { i.pixels = nullptr, i.memory = memory, i.stride = 191; }),
                   "stride is 191 bytes"));
}

TEST_CASE("row 18: unknown formats") {
    for (const uint32_t format : {0u, 5u, UINT32_MAX})
        CHECK(contains(refusal([&](auto& i) { i.format = format; }), "format"));
}

TEST_CASE("row 20: strides shorter than a row, and such that the size overflows") {
    CHECK(contains(refusal([](auto& i) { i.stride = 191; }),
                   "stride is 191 bytes, a row of 64 pixels has 192"));
    CHECK(contains(refusal([](auto& i) { i.stride = UINT64_MAX; }), "stride"));
    CHECK(contains(refusal([](auto& i) { i.stride = UINT64_MAX / 47; }), "stride"));
    CHECK(contains(refusal([](auto& i) { i.stride = uint64_t{1} << 32; }), "stride"));
}

TEST_CASE("rows 21 and 22: 0 x 0, 1 x 1, below the least and above the largest size") {
    const uint32_t sizes[][2] = {{0, 0},     {1, 1},     {63, 48},       {64, 47},
                                 {8193, 48}, {64, 8193}, {32767, 32767}, {UINT32_MAX, UINT32_MAX}};
    for (const auto& size : sizes)
        CHECK(contains(refusal([&](auto& i) { i.width = size[0], i.height = size[1]; }),
                       "64 x 48 to 8192 x 8192 expected"));
}

TEST_CASE("row 23: pixels at the end of the address space") {
    CHECK(contains(
        refusal([](auto& i) { i.pixels = reinterpret_cast<const void*>(UINTPTR_MAX - 100); }),
        "address space"));
}

TEST_CASE("row 10: an image of another size or format than the rig's is refused") {
    const defrec_image given = good();
    const defrec_image image = read_image("left", &given);
    CHECK_NOTHROW(expect_image("left", image, 64, 48, DEFREC_FORMAT_BGR8));
    CHECK_THROWS_AS(expect_image("left", image, 65, 48, DEFREC_FORMAT_BGR8), Error);
    CHECK_THROWS_AS(expect_image("left", image, 64, 50, DEFREC_FORMAT_BGR8), Error);
    CHECK_THROWS_AS(expect_image("left", image, 64, 48, DEFREC_FORMAT_RGB8), Error);
}
