// Ranges and defaults of the public headers: what is refused, in which words, and what 0 becomes.
#include <doctest/doctest.h>

#include <limits>

#include "sdk/contract/descs.hpp"
#include "sdk/contract/stage_params.hpp"

using namespace defrec;

namespace {

defrec_stereo_params stereo() {
    defrec_stereo_params params;
    DEFREC_INIT(&params);
    params.width = params.height = 64;
    fill_defaults(params);
    return params;
}

template <class Change>
std::string refusal(Change change) {
    defrec_stereo_params params = stereo();
    change(params);
    return range_error(params);
}

}  // namespace

TEST_CASE("zero becomes the default, numbers and other fields") {
    CHECK(stereo().disparities == 128);
    CHECK(stereo().stride == 64);
    defrec_rectify_params rectify;
    DEFREC_INIT(&rectify);
    rectify.format = DEFREC_FORMAT_BGR8;
    rectify.source_width = 100;
    rectify.source_height = 80;
    fill_defaults(rectify);
    CHECK(rectify.source_stride == 300);
    CHECK(rectify.height == 80);
    CHECK(range_error(rectify) == "");
}

TEST_CASE("a value out of range is named with its field and its range") {
    CHECK(refusal([](auto&) {}) == "");
    CHECK(refusal([](auto& p) { p.disparities = 510; }) == "");
    CHECK(refusal([](auto& p) { p.disparities = 511; }) ==
          "stereo: disparities is 511, 1 to 510 expected");
    CHECK(refusal([](auto& p) { p.min_disparity = -1; }) ==
          "stereo: min_disparity is -1, 0 to 1024 expected");
    CHECK(refusal([](auto& p) { p.stride = 63; }) ==
          "stereo: stride is 63, 64 to 1048576 expected");
    CHECK(refusal([](auto& p) { p.left_right = 0; }) ==
          "stereo: left_right is 0, at least 1 expected");
}

TEST_CASE("the first field out of range is the one that is named") {
    CHECK(refusal([](auto& p) { p.radius = 7, p.support = 26; }) ==
          "stereo: radius is 7, 2 to 6 expected");
}

TEST_CASE("floating point, cameras and formats") {
    defrec_warp_params warp;
    DEFREC_INIT(&warp);
    warp.width = warp.height = 2;
    warp.camera = {1, 1, 0, 0, 1, 0};
    fill_defaults(warp);
    CHECK(range_error(warp) == "");
    warp.tolerance_mm = -0.5f;
    CHECK(range_error(warp) == "warp: tolerance_mm is -0.5, at least 0 expected");
    warp.camera.cx = std::numeric_limits<double>::infinity();
    CHECK(range_error(warp) == "warp: camera.cx is inf, a finite number expected");
    warp.camera.fy = 0;
    CHECK(range_error(warp) == "warp: camera.fy is 0, above 0 expected");
    defrec_tracker_desc desc;
    DEFREC_INIT(&desc);
    CHECK(range_error(desc) == "");
    desc.self_calibration = DEFREC_SELF_CALIBRATION_OFF;
    CHECK(range_error(desc) == "");
    desc.self_calibration = 3;
    CHECK(range_error(desc) ==
          "desc.self_calibration is 3, one of REPORT (0), CORRECT (1), OFF (2) expected");
    desc.node_spacing_px = 3;
    CHECK(range_error(desc) == "desc.node_spacing_px is 3, 4 to 8192 expected");
    desc.format = 5;
    CHECK(range_error(desc) ==
          "desc.format is 5, one of GRAY8 (1), BGR8 (2), RGB8 (3), BGRA8 (4) expected");
}
