// The vertices that the solver compares with depth, and its passes.
#include "sdk/tracking/stages/surface_solver.hpp"

#include <doctest/doctest.h>

#include <set>
#include <string>

using namespace defrec;

TEST_CASE(
    "the sparse cloud has every second vertex of the grid, and none where there is no surface") {
    TemplateData data;
    data.grid.columns = 5;
    data.grid.rows = 4;
    for (int32_t i = 0; i < 20; ++i) {
        data.grid.vertex.push_back(i);
        data.vertices.emplace_back().position[0] = static_cast<float>(i);
    }
    data.grid.vertex[2] = -1;
    std::vector<float> found;
    for (const defrec_surface_point& point : sparse_vertices(data))
        found.push_back(point.position[0]);
    CHECK(found == std::vector<float>{0, 4, 10, 12, 14});
}

TEST_CASE("the solver's passes: the first needs no patches, the last two have them, too") {
    CHECK_FALSE(kSolverPasses.front().search);
    std::set<std::string> names;
    size_t times = 0;
    for (const SolverPass& pass : kSolverPasses) {
        names.insert(pass.time_name);
        ++times;
        if (!pass.search) continue;
        names.insert(pass.search->time_name);
        ++times;
    }
    CHECK(names.size() == times);
    for (size_t i = kSolverPasses.size() - 2; i < kSolverPasses.size(); ++i)
        CHECK(kSolverPasses[i].search);
}

TEST_CASE("the solver's passes go from coarse to fine") {
    for (size_t i = 1; i < kSolverPasses.size(); ++i) {
        const SolverPass &before = kSolverPasses[i - 1], &pass = kSolverPasses[i];
        CHECK(pass.match_weight < before.match_weight);
        CHECK(pass.icp_tukey_mm < before.icp_tukey_mm);
        REQUIRE(pass.search);
        CHECK(pass.search->wide_radius > pass.search->radius);
        if (!before.search) continue;
        CHECK(pass.patch_tukey_px < before.patch_tukey_px);
        const auto reach = [](const PatchSearch& search) { return search.radius << search.level; };
        CHECK(reach(*pass.search) < reach(*before.search));
    }
}
