// Models of plans with few vertices.
#include "sdk/report/light_plan.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>

using namespace defrec::cli;

namespace {

constexpr float kRadius = 20;

// Balls beside each other, of rings x sectors vertices each; every one is a part.
PlanEstimate balls(std::size_t count, std::uint32_t rings, std::uint32_t sectors) {
    PlanEstimate plan;
    auto model = std::make_shared<PlanModel>();
    for (std::size_t ball = 0; ball < count; ++ball) {
        const auto first = static_cast<std::uint32_t>(plan.vertices.size() / 3);
        const std::size_t begin = model->triangles.size() / 3;
        for (std::uint32_t ring = 0; ring < rings; ++ring)
            for (std::uint32_t sector = 0; sector < sectors; ++sector) {
                const float down =
                    3.1416f * (static_cast<float>(ring) + 0.5f) / static_cast<float>(rings);
                const float round =
                    6.2832f * static_cast<float>(sector) / static_cast<float>(sectors);
                plan.vertices.push_back(50 * static_cast<float>(ball) +
                                        kRadius * std::sin(down) * std::cos(round));
                plan.vertices.push_back(kRadius * std::cos(down));
                plan.vertices.push_back(100 + kRadius * std::sin(down) * std::sin(round));
            }
        for (std::uint32_t ring = 0; ring + 1 < rings; ++ring)
            for (std::uint32_t sector = 0; sector < sectors; ++sector) {
                const std::uint32_t a = first + ring * sectors + sector;
                const std::uint32_t b = first + ring * sectors + (sector + 1) % sectors;
                model->triangles.insert(model->triangles.end(),
                                        {a, b, a + sectors, b, b + sectors, a + sectors});
            }
        model->parts.push_back(
            {"ball " + std::to_string(ball), begin, model->triangles.size() / 3 - begin});
    }
    plan.status.assign(plan.vertices.size() / 3, VertexStatus::extrapolated);
    plan.expected_error_mm.assign(plan.status.size(), 0.5f);
    plan.model = model;
    return plan;
}

}  // namespace

TEST_CASE("a model with few vertices is kept as it is") {
    const PlanEstimate plan = balls(2, 8, 12);
    const LightPlan light(plan);
    CHECK(light.triangles().size() == plan.model->triangles.size());
    CHECK(light.positions(plan).size() == plan.vertices.size());
    REQUIRE(light.parts().size() == 2);
    CHECK(light.parts()[1].name == "ball 1");
    CHECK(light.parts()[1].first_triangle == light.parts()[0].triangle_count);
}

TEST_CASE("of a fine model some vertices stand for all, on its surface and part by part") {
    const PlanEstimate plan = balls(3, 100, 200);
    const LightPlan light(plan);
    const std::vector<float> xyz = light.positions(plan);
    CHECK(xyz.size() / 3 > LightPlan::kVertices / 4);
    CHECK(xyz.size() / 3 <= LightPlan::kVertices);
    REQUIRE(light.parts().size() == 3);
    for (std::size_t ball = 0; ball < 3; ++ball) {
        const PlanModel::Part& part = light.parts()[ball];
        CHECK(part.triangle_count > 100);
        for (std::size_t i = 0; i < 3 * part.triangle_count; ++i) {
            const std::uint32_t vertex = light.triangles()[3 * part.first_triangle + i];
            REQUIRE(3 * vertex + 2 < xyz.size());
            CHECK(std::hypot(xyz[3 * vertex] - 50 * static_cast<float>(ball), xyz[3 * vertex + 1],
                             xyz[3 * vertex + 2] - 100) == doctest::Approx(kRadius).epsilon(1e-4));
        }
    }
    CHECK(light.expected_error_mm(plan).size() == xyz.size() / 3);
}

TEST_CASE("what is unknown has no position, and a lost frame none at all") {
    PlanEstimate plan = balls(1, 8, 12);
    const LightPlan light(plan);
    plan.status[5] = VertexStatus::unknown;
    std::size_t missing = 0;
    for (const float coordinate : light.positions(plan)) missing += std::isnan(coordinate);
    CHECK(missing == 3);
    plan.vertices.clear();
    plan.status.clear();
    plan.expected_error_mm.clear();
    CHECK(light.positions(plan).empty());
    CHECK(light.expected_error_mm(plan).empty());
}

TEST_CASE("a model of more parts than vertices, or without a place, is left out") {
    CHECK(LightPlan(balls(LightPlan::kVertices + 1, 2, 3)).is_empty());
    PlanEstimate plan = balls(1, 8, 12);
    plan.vertices[4] = std::numeric_limits<float>::infinity();
    CHECK(LightPlan(plan).is_empty());
}
