// What is found in a model's mesh, put right, and refused.
#include "sdk/registration/model_surface.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <numbers>
#include <string>

#include "sdk/base/util/error.hpp"
#include "sdk/registration/test_organ.hpp"
#include "sdk/testing/check_says.hpp"

using namespace defrec;

namespace {

TestMesh ball(double radius, int divisions = 3) {
    return sphere_mesh(divisions,
                       [=](const Eigen::Vector3d& d) { return Eigen::Vector3d(radius * d); });
}

std::string refusal_of(const TestMesh& mesh) {
    try {
        const ModelSurface surface(mesh.vertices, mesh.triangles, "liver");
    } catch (const Error& error) {
        CHECK(error.status() == DEFREC_ERROR_ARGUMENT);
        return error.what();
    }
    return "accepted";
}

}  // namespace

TEST_CASE("a closed mesh: volume, area, centre, the angle between its facets") {
    const TestMesh mesh = ball(50, 4);
    const ModelSurface surface(mesh.vertices, mesh.triangles, "ball");
    const ModelFindings& found = surface.findings();
    CHECK(found.volume_mm3 == doctest::Approx(4.0 / 3 * std::numbers::pi * 125000).epsilon(0.01));
    CHECK(found.area_mm2 == doctest::Approx(4 * std::numbers::pi * 2500).epsilon(0.01));
    CHECK(surface.centroid().norm() < 0.01);
    CHECK(found.open_edges == 0);
    CHECK(found.odd_edges == 0);
    CHECK_FALSE(found.was_turned);
    CHECK(surface.has_outside());
    CHECK(found.facet_angle == doctest::Approx(0.04).epsilon(0.2));
}

TEST_CASE("a mesh that is inside out is turned, and told") {
    TestMesh mesh = ball(50);
    for (size_t i = 0; i < mesh.triangles.size(); i += 3)
        std::swap(mesh.triangles[i], mesh.triangles[i + 1]);
    const ModelSurface surface(mesh.vertices, mesh.triangles, "ball");
    CHECK(surface.findings().was_turned);
    CHECK(surface.has_outside());
    const auto nearest = surface.tree().nearest({0, 0, 60}, nullptr, 0);
    REQUIRE(nearest);
    CHECK(surface.tree().normal(nearest->triangle).z() > 0.9);
}

TEST_CASE("vertices that are listed for each triangle are one") {
    const TestMesh mesh = ball(50);
    TestMesh soup;
    for (const uint32_t vertex : mesh.triangles) {
        soup.triangles.push_back(static_cast<uint32_t>(soup.vertices.size() / 3));
        soup.add(mesh.vertex(vertex));
    }
    const ModelSurface surface(soup.vertices, soup.triangles, "ball");
    CHECK(surface.findings().open_edges == 0);
    CHECK(surface.has_outside());
}

TEST_CASE("triangles without an area are dropped and counted") {
    TestMesh mesh = ball(50);
    const size_t before = mesh.triangles.size();
    mesh.triangles.insert(mesh.triangles.end(), {0, 0, 1, 2, 3, 3});
    const ModelSurface surface(mesh.vertices, mesh.triangles, "ball");
    CHECK(surface.findings().dropped_triangles == 2);
    CHECK(surface.triangles().size() == before);
}

TEST_CASE("holes are counted; an open mesh has no outside") {
    TestMesh mesh = ball(50);
    mesh.triangles.resize(mesh.triangles.size() - 3);
    const ModelSurface one_hole(mesh.vertices, mesh.triangles, "ball");
    CHECK(one_hole.findings().open_edges == 3);
    CHECK(one_hole.has_outside());
    mesh.triangles.resize(mesh.triangles.size() / 6 * 3);
    const ModelSurface half(mesh.vertices, mesh.triangles, "ball");
    CHECK(half.findings().open_edges > 3);
    CHECK_FALSE(half.has_outside());
}

TEST_CASE("row 171: models that are refused, each with the reason") {
    TestMesh mesh = ball(50);
    mesh.vertices[4] = std::numeric_limits<float>::quiet_NaN();
    CHECK_SAYS(refusal_of(mesh), "liver: vertex 1 is");
    CHECK_SAYS(refusal_of(ball(0.1)), "looks like metres");
    CHECK_SAYS(refusal_of(ball(20000)), "looks like micrometres");
    mesh = ball(50);
    mesh.triangles[5] = 100000;
    CHECK_SAYS(refusal_of(mesh), "triangle 1 has vertex 100000");
    mesh.triangles.clear();
    CHECK_SAYS(refusal_of(mesh), "has no triangles");
    mesh.triangles = {0, 0, 7};
    CHECK_SAYS(refusal_of(mesh), "none of its 1 triangles has an area");
    mesh.triangles.assign(3 * 2000001, 0);
    CHECK_SAYS(refusal_of(mesh), "2000000 at most");
}
