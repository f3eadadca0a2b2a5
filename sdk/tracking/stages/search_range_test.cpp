#include "sdk/tracking/stages/search_range.hpp"

#include <doctest/doctest.h>

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
    check(widest_search_range(camera, 320, 20), 0, 96);  // 85 px
    check(widest_search_range(camera, 320, 100), 0, 48);
    check(widest_search_range(camera, 320, 1), 0, 144);  // 45 % of the image
    check(widest_search_range(camera, 1920, 1), 0, 256);
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

TEST_CASE("places of the grid without a vertex say nothing") {
    TemplateData data = grid_of({40, 45, 0, 250});
    data.grid.vertex[2] = data.grid.vertex[3] = -1;
    check(narrowed_search_range(data, {0, 96}), 16, 64);
}

TEST_CASE("what views that converge share is searched from their offset on") {
    defrec_camera camera{3250, 3250, 400, 225, 24, 210};
    check(widest_search_range(camera, 800, 290), 0, 64);  // 59 px beyond the offset
    TemplateData data = grid_of({240, 260});
    data.camera = camera;
    check(narrowed_search_range(data, {0, 64}), 16, 48);  // 30 to 50 px beyond it
}
