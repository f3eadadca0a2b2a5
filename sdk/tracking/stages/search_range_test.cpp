#include "sdk/tracking/stages/search_range.hpp"

#include <doctest/doctest.h>

#include "sdk/tracking/stages/coarse_search.hpp"

using namespace defrec;

namespace {

TemplateData grid_of(std::vector<float> disparities) {
    TemplateData data;
    for (size_t i = 0; i < disparities.size(); ++i)
        data.grid.vertex.push_back(static_cast<int32_t>(i));
    data.grid.disparity = std::move(disparities);
    return data;
}

void check(const SearchRange& range, uint32_t min_disparity, uint32_t disparities) {
    CHECK(range.min_disparity == min_disparity);
    CHECK(range.disparities == disparities);
}

}  // namespace

TEST_CASE(
    "before there is a template all is searched that is far enough away, in steps of 16, from 48 "
    "to 256") {
    const defrec_camera camera{340, 340, 160, 120, 5, 0};
    const auto widest = [&](uint32_t width, float min_depth_mm) {
        return widest_search_range(plausible_search_range(camera, width, min_depth_mm));
    };
    check(widest(320, 20), 0, 96);  // 85 px
    check(widest(320, 100), 0, 48);
    check(widest(320, 1), 0, 144);  // 45 % of the image
    check(widest(1920, 1), 0, 256);
    check(plausible_search_range(camera, 1920, 1), 0, 864);
    check(plausible_search_range(camera, 16384, 0.1F), 0, 1520);  // what stages search
}

TEST_CASE("the range goes where the disparities were seen, and stays where they fit it") {
    const SearchRange plausible{0, 864};
    check(placed_search_range(plausible, {8, 96}), 0, 256);
    check(placed_search_range(plausible, {60, 224}), 0, 256);
    check(placed_search_range(plausible, {300, 340}), 128, 256);
    check(placed_search_range(plausible, {100, 360}), 64, 336);
    check(placed_search_range(plausible, {0, 860}), 0, 496);
    check(placed_search_range({0, 192}, {100, 190}), 0, 192);
    check(placed_search_range({0, 1520}, {1400, 1500}), 1024, 496);
}

TEST_CASE(
    "with a template the search follows its surface, which may come nearer or go farther by half") {
    const SearchRange widest{0, 96};
    check(narrowed_search_range(grid_of({40, 60}), widest), 16, 80);
    check(narrowed_search_range(grid_of({40, 45}), widest), 16, 64);
    check(narrowed_search_range(grid_of({5}), widest), 0, 48);
    check(narrowed_search_range(grid_of({100}), widest), 48,
          64);  // nearer than was asked for, but observed there
}

TEST_CASE("where not all is searched that a surface spans, its nearest tissue is") {
    check(narrowed_search_range(grid_of({545, 857}), {512, 384}), 368, 496);
    check(narrowed_search_range(grid_of({545, 770}), {512, 384}), 288, 496);
    check(narrowed_search_range(grid_of({20, 480}), {0, 496}), 0, 496);
    check(narrowed_search_range(grid_of({20, 700}), {0, 496}), 208, 496);
}

TEST_CASE(
    "a surface of larger disparities than any stage searches leaves a range that is searched") {
    for (const float disparity : {1500.0f, 1999.0f, 2000.0f}) {
        const SearchRange range = narrowed_search_range(grid_of({disparity}), {0, 256});
        CHECK(range.min_disparity <= 1024);
        CHECK(range.disparities <= 496);
    }
}

TEST_CASE("places of the grid without a vertex say nothing") {
    TemplateData data = grid_of({40, 45, 0, 250});
    data.grid.vertex[2] = data.grid.vertex[3] = -1;
    check(narrowed_search_range(data, {0, 96}), 16, 64);
}

TEST_CASE("what views that converge share is searched from their offset on") {
    defrec_camera camera{3250, 3250, 400, 225, 24, 210};
    check(plausible_search_range(camera, 800, 290), 0, 64);  // 59 px beyond the offset
    TemplateData data = grid_of({240, 260});
    data.camera = camera;
    data.width = 800;
    check(narrowed_search_range(data, {0, 64}), 0, 64);  // 30 to 50 px beyond it, 24 px to spare
    check(narrowed_search_range(data, {0, 256}), 0, 96);
    data.grid.disparity = {205, 215};  // behind the offset, which no stage finds
    check(narrowed_search_range(data, {0, 256}), 0, 48);
    CHECK(describe(SearchRange{16, 64}, camera) ==
          "disparities 16 to 80 px, depths from 269 mm to 345.1 mm");
    camera.disparity_offset_px = 0;
    CHECK(describe(SearchRange{0, 64}, camera) == "disparities 0 to 64 px, depths from 1218.8 mm");
}
