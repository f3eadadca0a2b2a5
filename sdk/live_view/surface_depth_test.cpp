// Depth beneath a tilted plane and a dome, beside them, and before them.
#include "sdk/live_view/surface_depth.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>

using namespace defrec::cli;

namespace {

constexpr int kColumns = 21, kRows = 15;  // 2 mm apart

struct Mesh {
    std::vector<float> vertices;
    std::vector<std::uint32_t> triangles;
};

Mesh mesh(const std::function<float(float, float)>& z_of) {
    Mesh made;
    for (int row = 0; row < kRows; ++row)
        for (int column = 0; column < kColumns; ++column) {
            const float x = 2.0f * static_cast<float>(column) - 20,
                        y = 2.0f * static_cast<float>(row) - 14;
            made.vertices.insert(made.vertices.end(), {x, y, z_of(x, y)});
            if (row + 1 == kRows || column + 1 == kColumns) continue;
            const auto corner = static_cast<std::uint32_t>(row * kColumns + column);
            made.triangles.insert(made.triangles.end(),
                                  {corner, corner + 1, corner + kColumns + 1, corner,
                                   corner + kColumns + 1, corner + kColumns});
        }
    return made;
}

SurfaceDepth depth_of(const Mesh& made) { return {made.vertices, made.triangles}; }

}  // namespace

TEST_CASE("the depth is the distance along the normal, in triangles and at their sides") {
    const SurfaceDepth plane = depth_of(mesh([](float x, float) { return 80 + 0.75f * x; }));
    const cv::Vec3f away(-0.6f, 0, 0.8f);
    for (const cv::Vec3f& above : {cv::Vec3f(1.4f, 0.6f, 81.05f), cv::Vec3f(2, 4, 81.5f),
                                   cv::Vec3f(3, 4, 82.25f), cv::Vec3f(3, 3, 82.25f)})
        for (const float mm : {0.5f, 7.0f, -2.0f}) {
            const auto depth = plane.of(above + mm * away);
            REQUIRE(depth);
            CHECK(depth->mm == doctest::Approx(mm).epsilon(1e-4));
            CHECK(cv::norm(depth->above - above) < 1e-3);
        }
}

TEST_CASE("beside the surface, and beneath a part of it that is unknown, there is no depth") {
    Mesh flat = mesh([](float, float) { return 80.0f; });
    CHECK(depth_of(flat).of({19.5f, 0, 90}));
    CHECK_FALSE(depth_of(flat).of({20.5f, 0, 90}));
    CHECK_FALSE(depth_of(flat).of({30, 20, 80}));
    // A hole of 8 x 8 mm.
    for (int row = 6; row <= 8; ++row)
        for (int column = 9; column <= 11; ++column)
            flat.vertices[3 * static_cast<std::size_t>(row * kColumns + column)] =
                std::numeric_limits<float>::quiet_NaN();
    CHECK_FALSE(depth_of(flat).of({0, 0, 90}));
    CHECK(depth_of(flat).of({5.5f, 0, 90})->mm == doctest::Approx(10));
    CHECK_FALSE(SurfaceDepth({}, {}).of({0, 0, 90}));
}

TEST_CASE("a part is as deep as its shallowest vertex that is known") {
    const SurfaceDepth dome =
        depth_of(mesh([](float x, float y) { return 80 + (x * x + y * y) / 120; }));
    PlanEstimate plan;
    PlanModel model;
    model.parts = {{"vessel", 0, 198}, {"beside", 198, 1}};
    for (std::uint32_t i = 0; i < 198; ++i)
        model.triangles.insert(model.triangles.end(), {i, i + 1, i + 2});
    model.triangles.insert(model.triangles.end(), {200, 200, 200});
    plan.model = std::make_shared<const PlanModel>(model);
    // A line that rises to 6 mm beneath the dome's top, and goes on out of the view.
    for (int i = 0; i < 200; ++i) {
        const float x = 0.25f * static_cast<float>(i - 100);
        plan.vertices.insert(plan.vertices.end(), {x, 0, 86 + 0.2f * std::abs(x)});
    }
    plan.vertices.insert(plan.vertices.end(), {60, 0, 85});
    plan.status.assign(201, VertexStatus::extrapolated);
    const auto least = [&] {
        float mm = std::numeric_limits<float>::infinity();
        for (std::size_t v = 0; v < 200; ++v)
            if (plan.status[v] != VertexStatus::unknown)
                if (const auto depth = dome.of(cv::Vec3f(&plan.vertices[3 * v])))
                    mm = std::min(mm, depth->mm);
        return mm;
    };
    REQUIRE(dome.of(plan, model.parts[0]));
    CHECK(dome.of(plan, model.parts[0])->mm == doctest::Approx(6).epsilon(0.01));
    CHECK(dome.of(plan, model.parts[0])->mm == least());
    CHECK_FALSE(dome.of(plan, model.parts[1]));
    for (std::size_t v = 60; v < 140; ++v) plan.status[v] = VertexStatus::unknown;
    CHECK(dome.of(plan, model.parts[0])->mm > 6.5f);
    CHECK(dome.of(plan, model.parts[0])->mm == least());
    plan.vertices.clear();
    plan.status.clear();
    CHECK_FALSE(dome.of(plan, model.parts[0]));
}
