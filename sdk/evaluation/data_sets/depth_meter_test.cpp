// Depth by the library, of a plane whose depth is known.
#include "sdk/evaluation/data_sets/depth_meter.hpp"

#include <doctest/doctest.h>

#include "sdk/evaluation/data_sets/test_plane.hpp"

using namespace defrec::cli;

TEST_CASE("depth is that of the plane where views look in parallel, and where they converge") {
    const cv::Size size(320, 240);
    RunSettings settings;
    settings.backend = "cpu";
    settings.threads = 1;
    struct Case {
        double offset;  // of the principal points, px
        int disparity;  // of the images as given, px
    };
    // Views that converge share a rectified principal point no more: at 52 px of offset, 41 px of
    // it are in none of the rectified disparities, and the last plane has 0 of them.
    for (const Case& given : {Case{0, 20}, Case{52, 0}, Case{52, 8}, Case{52, -11}}) {
        CAPTURE(given.offset);
        CAPTURE(given.disparity);
        const auto meter = make_depth_meter(settings, plane_cameras(size, given.offset), 1);
        const cv::Mat depth = meter->depth_of(plane_frame(size, given.disparity));
        const double truth = 400 * 5 / (given.disparity + given.offset);
        int found = 0;
        for (int v = 20; v < size.height - 20; ++v) {
            for (int u = 40; u < size.width - 40; ++u) {
                if (depth.at<float>(v, u) == 0) continue;
                ++found;
                REQUIRE(depth.at<float>(v, u) == doctest::Approx(truth).epsilon(0.01));
            }
        }
        CHECK(found > 43000);  // of 48000
    }
}
