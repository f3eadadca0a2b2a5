// The nearest point of a mesh, against a search through all triangles.
#include "sdk/registration/triangle_tree.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <random>

#include "sdk/registration/test_organ.hpp"

using namespace defrec;

namespace {

// By dense samples of a triangle: never nearer than the nearest point, and nearly as near.
double sampled_distance(const TestMesh& mesh, size_t triangle, const Eigen::Vector3d& place) {
    constexpr int kSteps = 40;
    double least = std::numeric_limits<double>::infinity();
    const Eigen::Vector3d a = mesh.vertex(mesh.triangles[3 * triangle]),
                          b = mesh.vertex(mesh.triangles[3 * triangle + 1]),
                          c = mesh.vertex(mesh.triangles[3 * triangle + 2]);
    for (int i = 0; i <= kSteps; ++i)
        for (int k = 0; i + k <= kSteps; ++k)
            least =
                std::min(least, (a + (b - a) * i / kSteps + (c - a) * k / kSteps - place).norm());
    return least;
}

}  // namespace

TEST_CASE("the nearest point is as near as the best of many samples of all triangles") {
    const TestMesh mesh = organ_mesh(2);
    const TriangleTree tree(mesh.vertices, mesh.triangles);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-120, 120);
    for (int i = 0; i < 60; ++i) {
        const Eigen::Vector3d place(uniform(random), uniform(random), uniform(random));
        const auto nearest = tree.nearest(place, nullptr, static_cast<uint32_t>(i));
        REQUIRE(nearest);
        const double distance = std::sqrt(nearest->squared);
        CHECK((nearest->place - place).norm() == doctest::Approx(distance));
        double least = std::numeric_limits<double>::infinity();
        for (size_t k = 0; k < mesh.triangles.size() / 3; ++k)
            least = std::min(least, sampled_distance(mesh, k, place));
        CHECK(distance <= least + 1e-4);
        CHECK(distance >= least - 1.5);
        CHECK(sampled_distance(mesh, nearest->triangle, nearest->place) < 0.8);
    }
}

TEST_CASE("triangles that turn their back to the viewer are not looked at") {
    const TestMesh mesh =
        sphere_mesh(2, [](const Eigen::Vector3d& d) { return Eigen::Vector3d(50 * d); });
    const TriangleTree tree(mesh.vertices, mesh.triangles);
    const Eigen::Vector3d viewer(0, 0, -200), place(0, 0, 49);
    const auto all = tree.nearest(place, nullptr, 0);
    const auto seen = tree.nearest(place, &viewer, 0);
    REQUIRE(all);
    REQUIRE(seen);
    CHECK(all->place.z() > 45);
    CHECK(seen->place.z() < 0);
    CHECK(tree.normal(seen->triangle).dot(viewer - seen->place) > 0);
    const Eigen::Vector3d inside(0, 0, 0);
    CHECK_FALSE(tree.nearest(place, &inside, 0));
}
