// Where the surface can be compared with the live image.
#include "sdk/template/check_patches.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "sdk/template/decisions.hpp"

using namespace defrec;

namespace {

// A flat surface at 80 mm over the whole image, with texture where the function says so, and
// vertices so many px apart.
template <class Gray>
TemplateData flat_template(const Gray& gray, int spacing = 4) {
    TemplateData data;
    data.width = 320;
    data.height = 240;
    data.camera = {400, 400, 160, 120, 5, 0};
    SurfaceGrid& grid = data.grid;
    grid.spacing = spacing;
    grid.columns = 320 / spacing;
    grid.rows = 240 / spacing;
    const size_t cells = static_cast<size_t>(grid.columns * grid.rows);
    grid.disparity.assign(cells, 400 * 5 / 80.0f);
    grid.support.assign(cells, 0);
    for (size_t i = 0; i < cells; ++i) grid.vertex.push_back(static_cast<int32_t>(i));
    data.vertices.resize(cells);
    data.node_grid.columns = data.node_grid.rows = 2;
    data.node_grid.spacing_u = 319;
    data.node_grid.spacing_v = 239;
    data.node_grid.node = {0, 1, 2, 3};
    for (uint32_t y = 0; y < data.height; ++y)
        for (uint32_t x = 0; x < data.width; ++x)
            data.image.push_back(static_cast<uint8_t>(gray(x, y)));
    place_checks(data);
    return data;
}

double waves(uint32_t x, uint32_t y) { return 120 + 40 * std::sin(0.5 * x) * std::sin(0.4 * y); }

}  // namespace

TEST_CASE("texture everywhere: nearly every vertex lies in a check's window") {
    const TemplateData data = flat_template(waves);
    const double window = 2 * decisions::CheckPatches::kCheckRadius + 1;
    size_t covered = 0;
    for (size_t i = 0; i < data.vertices.size(); ++i) {
        if (data.check_of_vertex[i] < 0) continue;
        ++covered;
        const defrec_patch& check = data.checks[static_cast<size_t>(data.check_of_vertex[i])];
        CHECK(std::abs(check.u - 4.0 * (i % 80)) <= window / 2);
        CHECK(std::abs(check.v - 4.0 * (i / 80)) <= window / 2);
    }
    CHECK(covered > 0.8 * static_cast<double>(data.vertices.size()));
}

TEST_CASE("a check's window that holds two vertices a side is there for both") {
    const double window = 2 * decisions::CheckPatches::kCheckRadius + 1;
    for (const int spacing : {8, 10}) {
        CAPTURE(spacing);
        const TemplateData data = flat_template(waves, spacing);
        CHECK(data.checks.size() > 0.2 * static_cast<double>(data.vertices.size()));
        CHECK(data.checks.size() < 0.3 * static_cast<double>(data.vertices.size()));
        for (size_t i = 0; i < data.vertices.size(); ++i) {
            if (data.check_of_vertex[i] < 0) continue;
            const defrec_patch& check = data.checks[static_cast<size_t>(data.check_of_vertex[i])];
            const auto column = static_cast<int>(i) % data.grid.columns;
            CHECK(std::abs(check.u - spacing * column) <= window / 2);
        }
    }
    const TemplateData sparse = flat_template(waves, 16);
    CHECK(sparse.checks.size() > 0.8 * static_cast<double>(sparse.vertices.size()));
}

TEST_CASE("no check where texture does not tell a slide: plain, or in one direction only") {
    const TemplateData data = flat_template([](uint32_t x, uint32_t y) {
        if (x < 100) return 120.0;
        if (x < 200) return 120 + 40 * std::sin(0.5 * y);
        return waves(x, y);
    });
    CHECK(data.checks.size() > 20);
    // A window that reaches over the border of two kinds of texture has both directions.
    for (const defrec_patch& check : data.checks)
        CHECK((check.u > 198 - decisions::CheckPatches::kCheckRadius ||
               std::abs(check.u - 100) <= decisions::CheckPatches::kCheckRadius + 2));
}
