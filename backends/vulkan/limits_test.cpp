// What is too large for the shaders is refused when it is made, with the limit in the text.
#include <doctest/doctest.h>

#include <string>

#include "backends/vulkan/test_device.hpp"
#include "include/defrec_c.h"
#include "sdk/contract/stage_params.hpp"

using namespace defrec;

namespace {

// The text of the refusal as unsupported, else "".
std::string refusal(const auto& make) {
    try {
        make();
    } catch (const StageError& error) {
        if (error.status() == DEFREC_ERROR_UNSUPPORTED) return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("a buffer whose bytes an int does not count is refused") {
    if (!under_test::available()) return;
    CHECK(refusal([] {
              vulkan::Buffer(under_test::device(), uint64_t{1} << 31);
          }).find("2147483648 bytes") != std::string::npos);
}

TEST_CASE("memory that no multiple of whole words holds is refused") {
    if (!under_test::available()) return;
    for (const uint64_t size : {UINT64_MAX, UINT64_MAX - 15}) try {
            under_test::device().release_host(under_test::device().allocate_host(size));
            FAIL("there are no ", size, " bytes");
        } catch (const StageError& error) {
            CHECK(error.status() == DEFREC_ERROR_OUT_OF_MEMORY);
        }
}

TEST_CASE("row 48: ransac refuses more landmarks than its loops may go through") {
    if (!under_test::available()) return;
    defrec_ransac_params p{};
    p.iterations = 100;
    fill_defaults(p);
    p.landmarks = 253465;
    CHECK(refusal([&] { vulkan::make_ransac(p, under_test::device()); }) == "");
    ++p.landmarks;
    CHECK(refusal([&] { vulkan::make_ransac(p, under_test::device()); }) ==
          "ransac: 253466 landmarks with that many iterations; this device takes at most 253465");
}

TEST_CASE("lm refuses more landmarks than it moves rigidly onto matches") {
    if (!under_test::available()) return;
    defrec_lm_params p{};
    p.width = p.height = 64;
    p.camera = {100, 100, 32, 24, 5, 0};
    p.presolve = 1;
    fill_defaults(p);
    const auto refused = [&] { return refusal([&] { vulkan::make_lm(p, under_test::device()); }); };
    p.landmarks = 512000;
    CHECK(refused() == "");
    ++p.landmarks;
    CHECK(refused().find("landmarks to move rigidly onto matches") != std::string::npos);
    p.presolve = 0;
    CHECK(refused() == "");
}

TEST_CASE("the shaders of stereo have the shared memory they need for the largest image") {
    if (!under_test::available()) return;
    defrec_stereo_params p{};
    p.width = p.height = DEFREC_MAX_SIDE;
    p.disparities = 64;
    fill_defaults(p);
    for (const bool wide : {false, true}) {
        vulkan::Device device(under_test::new_logical_device());
        if (wide && !device.physical().packed_dot) continue;
        device.set_wide(wide);
        // The shaders are made before the buffers, of which lavapipe takes no such large ones.
        const std::string text = refusal([&] { vulkan::make_stereo(p, device); });
        CHECK_MESSAGE((text == "" || text.starts_with("a buffer of ")), text);
    }
}

TEST_CASE("warp and align refuse more than a dispatch has work groups for") {
    if (!under_test::available()) return;
    const uint64_t maximum =
        64 * uint64_t{under_test::device().limits().maxComputeWorkGroupCount[0]};
    if (maximum >= UINT32_MAX) return;
    defrec_warp_params p{};
    p.width = p.height = 64;
    p.camera = {100, 100, 32, 24, 5, 0};
    fill_defaults(p);
    p.points = uint32_t(maximum);
    CHECK(refusal([&] { vulkan::make_warp(p, under_test::device()); }) == "");
    ++p.points;
    CHECK(refusal([&] { vulkan::make_warp(p, under_test::device()); }).find("points") !=
          std::string::npos);
    defrec_align_params a{};
    a.width = a.stride = 64;
    a.height = 48;
    a.patch_radius = a.search_radius = 1;
    a.camera = p.camera;
    fill_defaults(a);
    a.patches = uint32_t(maximum);
    CHECK(refusal([&] { vulkan::make_align(a, under_test::device()); }) == "");
    ++a.patches;
    CHECK(refusal([&] { vulkan::make_align(a, under_test::device()); }).find("patches") !=
          std::string::npos);
}
