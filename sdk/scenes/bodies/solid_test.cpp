// The meshes of a body's parts: closed, turned outwards, of the right size, and as PLY.
#include "sdk/scenes/bodies/solid.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cstring>
#include <map>
#include <numbers>

using defrec::cli::mesh_of;
using defrec::cli::ply_of;
using defrec::cli::SolidMesh;

namespace {

/// Every edge is passed once in each direction.
bool is_closed(const SolidMesh& mesh) {
    std::map<std::pair<int, int>, int> passed;
    for (const auto& t : mesh.triangles) {
        for (std::size_t i = 0; i < 3; ++i) ++passed[{t[i], t[(i + 1) % 3]}];
    }
    for (const auto& [edge, times] : passed) {
        const auto back = passed.find({edge.second, edge.first});
        if (times != 1 || back == passed.end()) return false;
    }
    return !passed.empty();
}

/// Positive where the triangles turn counter-clockwise, seen from outside.
double volume(const SolidMesh& mesh) {
    double sum = 0;
    const auto point = [&](std::int32_t i) { return mesh.points[static_cast<std::size_t>(i)]; };
    for (const auto& t : mesh.triangles) {
        sum += point(t[0]).dot(point(t[1]).cross(point(t[2]))) / 6;
    }
    return sum;
}

}  // namespace

TEST_CASE("the mesh of a box is closed and has its volume") {
    const SolidMesh mesh = mesh_of({{-55, -40, 0}, {55, 40, 14}}, 5);
    CHECK(is_closed(mesh));
    CHECK(volume(mesh) == doctest::Approx(110 * 80 * 14));
    // 22 x 16 x 3 cells.
    CHECK(mesh.triangles.size() == 4 * (22 * 16 + 22 * 3 + 16 * 3));
    SolidMesh open = mesh;
    open.triangles.pop_back();
    CHECK(!is_closed(open));
}

TEST_CASE("the mesh of a ball is closed and nearly has its volume") {
    const SolidMesh mesh = mesh_of({{9, -4, 18}, 8}, 1.5);
    CHECK(is_closed(mesh));
    CHECK(volume(mesh) == doctest::Approx(4.0 / 3.0 * std::numbers::pi * 512).epsilon(0.02));
    for (const Eigen::Vector3d& p : mesh.points) {
        CHECK((p - Eigen::Vector3d(9, -4, 18)).norm() == doctest::Approx(8));
    }
}

TEST_CASE("a PLY file names its points and triangles and holds them all") {
    const SolidMesh mesh = mesh_of({{0, 0, 0}, {1, 2, 3}}, 5);
    const std::string bytes = ply_of(mesh);
    const std::string header =
        "ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\nproperty float "
        "y\nproperty float z\nelement face 12\nproperty list uchar int vertex_indices\n"
        "end_header\n";
    REQUIRE(bytes.substr(0, header.size()) == header);
    REQUIRE(bytes.size() == header.size() + 8 * 12 + 12 * 13);
    for (std::size_t i = 0; i < 8; ++i) {
        float point[3];
        std::memcpy(point, bytes.data() + header.size() + 12 * i, sizeof point);
        CHECK(Eigen::Vector3f(point[0], point[1], point[2]).cast<double>() == mesh.points[i]);
    }
    for (std::size_t i = 0; i < 12; ++i) {
        const char* face = bytes.data() + header.size() + 8 * 12 + 13 * i;
        std::int32_t corners[3];
        std::memcpy(corners, face + 1, sizeof corners);
        CHECK(face[0] == 3);
        CHECK(std::equal(corners, corners + 3, mesh.triangles[i].begin()));
    }
}
