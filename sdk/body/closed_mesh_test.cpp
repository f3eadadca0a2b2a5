// Which meshes ClosedMesh refuses, with which words, and what it says lies inside of the others.
#include "sdk/body/closed_mesh.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "sdk/base/util/error.hpp"

using namespace defrec;
using Eigen::Vector3d;

namespace {

struct TestMesh {
    std::vector<Vector3d> vertices;
    std::vector<uint32_t> triangles;

    uint32_t add(const Vector3d& vertex) {
        vertices.push_back(vertex);
        return static_cast<uint32_t>(vertices.size() - 1);
    }
    void add_quad(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
        for (const uint32_t index : {a, b, c, a, c, d}) triangles.push_back(index);
    }
    TestMesh& join(const TestMesh& other) {
        const auto first = static_cast<uint32_t>(vertices.size());
        vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
        for (const uint32_t index : other.triangles) triangles.push_back(first + index);
        return *this;
    }
    TestMesh turned_out() const {
        TestMesh mesh = *this;
        for (size_t i = 0; i < triangles.size(); i += 3)
            std::swap(mesh.triangles[i], mesh.triangles[i + 1]);
        return mesh;
    }
    template <class Map>
    TestMesh mapped(const Map& map) const {
        TestMesh mesh = *this;
        for (Vector3d& vertex : mesh.vertices) vertex = map(vertex);
        return mesh;
    }
    TestMesh moved(const Vector3d& by) const {
        return mapped([&](const Vector3d& v) -> Vector3d { return v + by; });
    }
    TestMesh scaled(double by) const {
        return mapped([&](const Vector3d& v) -> Vector3d { return by * v; });
    }

    ClosedMesh make(const char* name = "mesh") const {
        std::vector<float> xyz;
        for (const Vector3d& vertex : vertices)
            for (const double value : vertex) xyz.push_back(static_cast<float>(value));
        return ClosedMesh({xyz.data(), vertices.size(), triangles.data(), triangles.size() / 3},
                          name);
    }
};

template <class Call>
std::string refusal_of(const Call& call) {
    try {
        call();
    } catch (const Error& error) {
        CHECK(error.status() == DEFREC_ERROR_ARGUMENT);
        return error.what();
    }
    return "none";
}

std::string refusal(const TestMesh& mesh, const char* name = "mesh") {
    return refusal_of([&] { mesh.make(name); });
}

bool has(const std::string& text, const std::string& part) {
    const bool found = text.find(part) != std::string::npos;
    if (!found) MESSAGE(text);
    return found;
}

bool lacks(const std::string& text, const std::string& part) {
    return text.find(part) == std::string::npos;
}

// Sides of count x count squares, each of two triangles.
TestMesh make_box(const Vector3d& low, const Vector3d& high, int count = 1) {
    TestMesh mesh;
    std::map<std::array<int, 3>, uint32_t> index;
    const auto vertex = [&](const std::array<int, 3>& at) {
        const auto [found, is_new] = index.try_emplace(at, 0u);
        if (is_new) {
            const Vector3d share = Vector3d(at[0], at[1], at[2]) / count;
            found->second = mesh.add(low + share.cwiseProduct(high - low));
        }
        return found->second;
    };
    for (size_t axis = 0; axis < 3; ++axis)
        for (const int side : {0, count})
            for (int i = 0; i < count; ++i)
                for (int k = 0; k < count; ++k) {
                    std::array<uint32_t, 4> corner{};
                    for (size_t c = 0; c < 4; ++c) {
                        std::array<int, 3> at{};
                        at[axis] = side;
                        at[(axis + 1) % 3] = i + (c == 1 || c == 2);
                        at[(axis + 2) % 3] = k + (c == 2 || c == 3);
                        corner[c] = vertex(at);
                    }
                    if (side == 0) std::swap(corner[1], corner[3]);
                    mesh.add_quad(corner[0], corner[1], corner[2], corner[3]);
                }
    return mesh;
}

TestMesh make_cube(double low, double high, int count = 1) {
    return make_box(Vector3d::Constant(low), Vector3d::Constant(high), count);
}

TestMesh make_sphere(double radius, int count) {
    return make_cube(-1, 1, count).mapped([&](const Vector3d& v) -> Vector3d {
        return radius * v.normalized();
    });
}

TestMesh make_torus(double around, double tube, int columns, int rows) {
    TestMesh mesh;
    const auto index = [&](int i, int k) {
        return static_cast<uint32_t>((i % columns) * rows + k % rows);
    };
    for (int i = 0; i < columns; ++i)
        for (int k = 0; k < rows; ++k) {
            const double u = 2 * std::numbers::pi * i / columns,
                         v = 2 * std::numbers::pi * k / rows;
            const double far = around + tube * std::cos(v);
            mesh.add({far * std::cos(u), far * std::sin(u), tube * std::sin(v)});
            mesh.add_quad(index(i, k), index(i + 1, k), index(i + 1, k + 1), index(i, k + 1));
        }
    return mesh;
}

TestMesh turned(const TestMesh& mesh) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    return mesh.mapped([&](const Vector3d& v) -> Vector3d { return turn * v; });
}

// The volume as the sum over the cubes of a grid with that edge.
double volume_of(const ClosedMesh& mesh, double edge) {
    double volume = 0;
    const Vector3d low = mesh.low() - Vector3d::Constant(0.37 * edge);
    for (double z = low.z(); z < mesh.high().z() + edge; z += edge)
        for (double y = low.y(); y < mesh.high().y() + edge; y += edge)
            for (double x = low.x(); x < mesh.high().x() + edge; x += edge)
                volume += mesh.inside_share({x, y, z}, edge) * edge * edge * edge;
    return volume;
}

std::vector<defrec_surface_point> make_surface(const Vector3d& centre, double side, int count) {
    std::vector<defrec_surface_point> surface;
    for (int y = 0; y < count; ++y)
        for (int x = 0; x < count; ++x) {
            defrec_surface_point point{};
            const Vector3d at(x / (count - 1.0) - 0.5, y / (count - 1.0) - 0.5, 0);
            Eigen::Map<Eigen::Vector3f>(point.position) = (centre + side * at).cast<float>();
            point.normal[2] = -1;
            surface.push_back(point);
        }
    return surface;
}

std::string meeting(const TestMesh& mesh, const std::vector<defrec_surface_point>& surface) {
    const ClosedMesh closed = mesh.make();
    return refusal_of([&] { closed.check_meets(surface, "mesh"); });
}

}  // namespace

TEST_CASE("a closed mesh is copied") {
    const ClosedMesh mesh = make_box({-1, -2, -3}, {10, 20, 30}).make();
    CHECK(mesh.vertices().size() == 24);
    CHECK(mesh.triangles().size() == 36);
    CHECK(mesh.low() == Vector3d(-1, -2, -3));
    CHECK(mesh.high() == Vector3d(10, 20, 30));
    // A vertex of no triangle.
    TestMesh loose = make_cube(0, 10);
    loose.add({1000, 0, 0});
    CHECK(loose.make().high() == Vector3d(10, 10, 10));
}

TEST_CASE("a mesh that is not one is refused") {
    const float xyz[12] = {0, 0, 0, 10, 0, 0, 0, 10, 0, 0, 0, 10};
    const uint32_t index[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    const auto refused = [](const defrec_mesh& mesh) {
        return refusal_of([&] { ClosedMesh(mesh, "regions[2].mesh"); });
    };
    CHECK(refused({xyz, 4, index, 4}) == "none");
    CHECK(refused({nullptr, 4, index, 4}) ==
          "regions[2].mesh.vertices is NULL, expected 4 vertices");
    CHECK(refused({xyz, 4, nullptr, 4}) ==
          "regions[2].mesh.triangles is NULL, expected 4 triangles");
    CHECK(has(refused({xyz, 1000001, index, 4}), "has 1000001 vertices, expected 0..1000000"));
    CHECK(has(refused({xyz, 4, index, 1000001}), "has 1000001 triangles, expected 0..1000000"));
    CHECK(has(refused({xyz, 4, index, 3}), "has 3 triangles, expected a closed mesh"));
    CHECK(has(refused({nullptr, 0, nullptr, 0}), "has 0 triangles"));
    CHECK(has(refused({nullptr, 0, index, 4}), "triangle 0 has vertex 0, expected less"));
    CHECK(has(refused({xyz, 3, index, 4}),
              "triangle 1 has vertex 3, expected less than the number of vertices, 3"));
}

TEST_CASE("coordinates that are not finite are refused") {
    for (const double wrong :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
          -std::numeric_limits<double>::infinity()})
        for (const Eigen::Index axis : {0, 1, 2}) {
            TestMesh mesh = make_cube(0, 10);
            mesh.vertices[5][axis] = wrong;
            CHECK(has(refusal(mesh, "regions[0].mesh"), "regions[0].mesh: vertex 5 is ("));
        }
}

TEST_CASE("a triangle with a vertex twice is refused, one without an area is not") {
    TestMesh twice = make_cube(0, 10);
    twice.triangles[3 * 7 + 2] = twice.triangles[3 * 7];
    CHECK(has(refusal(twice), "triangle 7 has vertex"));
    // A vertex on a side's diagonal, to which one of the two triangles does not reach.
    TestMesh flat = make_cube(0, 10);
    const uint32_t a = flat.triangles[0], b = flat.triangles[1], c = flat.triangles[2];
    const uint32_t middle = flat.add((flat.vertices[a] + flat.vertices[c]) / 2);
    flat.triangles[2] = middle;
    for (const uint32_t index : {middle, b, c, a, middle, c}) flat.triangles.push_back(index);
    CHECK(refusal(flat) == "none");
    CHECK(volume_of(flat.make(), 2.5) == doctest::Approx(1000));
}

TEST_CASE("a size that is not one in mm is refused") {
    CHECK(has(refusal(make_sphere(0.055, 8)),
              "looks like metres: the largest side of its box is 0.11, expected 3..2000 mm"));
    CHECK(has(refusal(make_cube(0, 2.99)), "looks like metres"));
    CHECK(refusal(make_cube(0, 3.01)) == "none");
    CHECK(refusal(make_cube(0, 1999)) == "none");
    CHECK(has(refusal(make_cube(0, 2001)), "micrometres: the largest side of its box is 2001"));
    CHECK(has(refusal(make_cube(-3e38, 3e38)), "micrometres"));
    CHECK(has(refusal(make_cube(0, 0)), "looks like metres: the largest side of its box is 0,"));
}

TEST_CASE("edges without two triangles in opposite directions are refused, with their place") {
    TestMesh open = make_cube(0, 10, 3);
    const uint32_t from = open.triangles[15], to = open.triangles[16];
    open.triangles.erase(open.triangles.begin() + 15, open.triangles.begin() + 18);
    const std::string message = refusal(open);
    CHECK(has(message, "is not closed: the edge from vertex "));
    CHECK(has(message, ", expected one forth and one back"));
    CHECK(has(message, "vertex " + std::to_string(std::min(from, to)) + " ("));
    CHECK(lacks(message, "merge"));

    TestMesh turned_triangle = make_cube(0, 10, 3);
    std::swap(turned_triangle.triangles[15], turned_triangle.triangles[16]);
    CHECK(has(refusal(turned_triangle), "is not oriented consistently: the edge from vertex "));

    TestMesh twice = make_cube(0, 10);
    for (int i = 0; i < 3; ++i) twice.triangles.push_back(twice.triangles[static_cast<size_t>(i)]);
    CHECK(has(refusal(twice), "has an edge of more than two triangles"));

    // Cubes that share an edge.
    TestMesh pair = make_cube(0, 10);
    TestMesh other = make_box({10, 10, 0}, {20, 20, 10});
    pair.join(other);
    for (uint32_t& index : pair.triangles)
        for (uint32_t i = 0; i < 8; ++i)
            if (pair.vertices[i] == pair.vertices[index]) index = i;
    CHECK(has(refusal(pair), "has an edge of more than two triangles: the edge from vertex "));

    // A list of triangles that share no vertices.
    const TestMesh cube = make_cube(0, 10);
    TestMesh apart;
    for (const uint32_t index : cube.triangles)
        apart.triangles.push_back(apart.add(cube.vertices[index]));
    CHECK(has(refusal(apart), "vertices 0 and 3 lie at the same place: merge them"));
}

TEST_CASE("a mesh that is inside out is refused, as a whole and in part") {
    CHECK(has(refusal(make_sphere(20, 6).turned_out()),
              "is inside out: its triangles are clockwise seen from outside"));
    TestMesh part = make_sphere(20, 6);
    part.join(make_sphere(5, 4).turned_out().moved({50, 0, 0}));
    CHECK(has(refusal(part), "is inside out at (4"));
    // A small one, between the lines of the grid.
    TestMesh small = make_cube(0, 300);
    small.join(make_cube(0, 0.2).turned_out().moved({310, 155, 155}));
    CHECK(has(refusal(small), "is inside out at (310."));
}

TEST_CASE("a mesh without volume is refused") {
    TestMesh flat = make_box({0, 0, 5}, {10, 10, 5}, 2);
    CHECK(has(refusal(flat), "has no volume: its triangles enclose 0 mm3"));
    CHECK(refusal(make_box({0, 0, 5}, {10, 10, 5.01}, 2)) == "none");
    TestMesh zero = make_cube(0, 10);
    zero.join(make_cube(0, 10).turned_out().moved({20, 0, 0}));
    CHECK(has(refusal(zero), "has no volume"));
}

TEST_CASE("triangles that cross are refused, with their place") {
    TestMesh pair = make_sphere(10, 6);
    const size_t first = pair.triangles.size() / 3;
    pair.join(make_sphere(10, 6).moved({15, 0.3, 0.2}));
    const std::string message = refusal(pair);
    CHECK(has(message, "intersects itself: triangles "));
    int one = 0, other = 0;
    double x = 0, y = 0, z = 0;
    REQUIRE(std::sscanf(message.c_str(),
                        "mesh intersects itself: triangles %d and %d cross at (%lf %lf %lf)", &one,
                        &other, &x, &y, &z) == 5);
    CHECK(static_cast<size_t>(one) < first);
    CHECK(static_cast<size_t>(other) >= first);
    CHECK(Vector3d(x, y, z).norm() == doctest::Approx(10).epsilon(0.05));
    CHECK((Vector3d(x, y, z) - Vector3d(15, 0.3, 0.2)).norm() == doctest::Approx(10).epsilon(0.05));

    // A spike through the opposite side, whose triangles share a vertex with their neighbours.
    TestMesh spike = make_cube(0, 10, 4);
    for (Vector3d& vertex : spike.vertices)
        if (vertex == Vector3d(5, 5, 10)) vertex = {5.1, 5.2, -3};
    CHECK(has(refusal(spike), "intersects itself: triangles "));
    for (Vector3d& vertex : spike.vertices)
        if (vertex == Vector3d(5.1, 5.2, -3)) vertex = {5.1, 5.2, 3};
    CHECK(refusal(spike) == "none");
    // The tip of a triangle through the one beside it, with which it has a vertex in common.
    TestMesh fold = make_cube(0, 10, 2);
    for (Vector3d& vertex : fold.vertices)
        if (vertex == Vector3d(5, 5, 10)) vertex = {12, 5.5, 8};
    CHECK(has(refusal(fold), "intersects itself"));
}

TEST_CASE("parts that overlap with their vertices and edges on each other are refused") {
    const auto joined = [](TestMesh a, const TestMesh& b) { return refusal(a.join(b)); };
    CHECK(has(joined(make_cube(0, 10), make_cube(5, 15)), "intersects itself"));
    CHECK(has(joined(make_cube(0, 10, 10), make_cube(5, 15, 10)), "lies in 2 of its parts"));
    CHECK(has(joined(make_cube(0, 10, 10), make_cube(0, 10, 10).moved({5, 0, 0})),
              "lies in 2 of its parts"));
    CHECK(has(joined(make_box({-20, -5, -5}, {20, 5, 5}), make_box({-5, -20, -5}, {5, 20, 5})),
              "intersects itself"));
    CHECK(has(joined(make_cube(0, 10), make_cube(0, 10)), "lies in 2 of its parts"));
    // No edge passes through a side, and no triangle's middle lies in the other part.
    CHECK(
        has(joined(make_cube(0, 10), make_box({9, 0, 0}, {19, 10, 10})), "lies in 2 of its parts"));
    CHECK(has(joined(make_sphere(20, 6), make_sphere(10, 6)), "lies in 2 of its parts"));
}

TEST_CASE("parts that touch are taken") {
    const auto joined = [](TestMesh a, const TestMesh& b) { return a.join(b); };
    for (const TestMesh& mesh :
         {joined(make_cube(0, 10), make_box({0, 0, 10}, {10, 10, 20})),
          joined(make_cube(0, 10), make_box({3, 2, 10}, {14, 7, 20}, 3)),
          joined(make_cube(0, 10), make_box({3, 2, 9.99999}, {14, 7, 20})),
          joined(make_cube(0, 10), make_box({10, 0, 0}, {20, 10, 10})),
          joined(make_cube(0, 10), make_cube(10, 20)),
          joined(make_cube(0, 10), make_box({10, 10, 0}, {20, 20, 10}, 2)),
          joined(make_cube(0, 10, 4), make_box({2, 10, 0}, {8, 20, 10}, 5))}) {
        CHECK(refusal(mesh) == "none");
        CHECK(refusal(turned(mesh)) == "none");
        CHECK(refusal(turned(mesh).moved({150, -90, 400})) == "none");
    }
}

TEST_CASE("a cavity is outside") {
    TestMesh shell = make_sphere(20, 16);
    shell.join(make_sphere(10, 16).turned_out());
    const ClosedMesh mesh = shell.make();
    CHECK(!mesh.contains({0.1, 0.2, 0}));
    CHECK(mesh.contains({15, 0, 0}));
    CHECK(!mesh.contains({21, 0, 0}));
    CHECK(volume_of(mesh, 3) == doctest::Approx(4.0 / 3 * std::numbers::pi * 7000).epsilon(0.02));
    shell.join(make_sphere(5, 4));
    CHECK(shell.make().contains({0.1, 0.2, 0}));
}

TEST_CASE("shares of cubes") {
    const ClosedMesh mesh = make_cube(0, 10, 3).make();
    CHECK(mesh.inside_share({5, 5, 5}, 2) == 1);
    CHECK(mesh.inside_share({5, 5, 5}, 10) == 1);
    CHECK(mesh.inside_share({5, 5, 5}, 20) == doctest::Approx(1.0 / 8));
    CHECK(mesh.inside_share({12, 5, 5}, 2) == 0);
    CHECK(mesh.inside_share({5, 5, -2}, 2) == 0);
    CHECK(mesh.inside_share({50, 50, 50}, 2) == 0);
    CHECK(mesh.inside_share({10, 5, 5}, 4) == doctest::Approx(0.5));
    CHECK(mesh.inside_share({0, 5, 5}, 4) == doctest::Approx(0.5));
    CHECK(mesh.inside_share({5, 10, 5}, 4) == doctest::Approx(0.5));
    CHECK(mesh.inside_share({10, 10, 0}, 4) == doctest::Approx(1.0 / 8));
    CHECK(mesh.inside_share({5, 5, 10.9}, 4) == doctest::Approx(1.1 / 4));
    CHECK(mesh.inside_share({5, 5, -0.7}, 4) == doctest::Approx(1.3 / 4));
}

TEST_CASE("volumes are those of the shapes") {
    constexpr double kPi = std::numbers::pi;
    CHECK(volume_of(turned(make_cube(-10, 10, 2)).make(), 2.5) ==
          doctest::Approx(8000).epsilon(0.005));
    CHECK(volume_of(make_sphere(20, 40).make(), 3) ==
          doctest::Approx(4.0 / 3 * kPi * 8000).epsilon(0.01));
    CHECK(volume_of(turned(make_torus(20, 6, 90, 30)).make(), 3) ==
          doctest::Approx(2 * kPi * kPi * 20 * 36).epsilon(0.02));
    TestMesh two = make_sphere(10, 20);
    two.join(make_sphere(15, 20).moved({40, 3, 1}));
    CHECK(volume_of(two.make(), 3) == doctest::Approx(4.0 / 3 * kPi * (1000 + 3375)).epsilon(0.01));
}

TEST_CASE("what lies inside is right for lines through vertices and edges") {
    // All vertices, edges and diagonals lie above places of the grid.
    const ClosedMesh cube = make_cube(-4, 4, 4).make();
    for (int z = -5; z <= 5; ++z)
        for (int y = -5; y <= 5; ++y)
            for (int x = -5; x <= 5; ++x) {
                const int most = std::max({std::abs(x), std::abs(y), std::abs(z)});
                if (most != 4) CHECK(cube.contains(Vector3d(x, y, z)) == (most < 4));
            }
    // Its corners lie on the axes.
    TestMesh octahedron;
    for (const int axis : {0, 1, 2})
        for (const double side : {-4.0, 4.0}) octahedron.add(side * Vector3d::Unit(axis));
    for (const uint32_t z : {4u, 5u})
        for (const auto& [x, y] : {std::pair(1u, 3u), {3u, 0u}, {0u, 2u}, {2u, 1u}})
            for (const uint32_t index : {z == 5 ? x : y, z == 5 ? y : x, z})
                octahedron.triangles.push_back(index);
    const ClosedMesh eight = octahedron.make();
    for (int z = -5; z <= 5; ++z)
        for (int y = -5; y <= 5; ++y)
            for (int x = -5; x <= 5; ++x) {
                const int sum = std::abs(x) + std::abs(y) + std::abs(z);
                if (sum != 4) CHECK(eight.contains(Vector3d(x, y, z)) == (sum < 4));
            }
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    for (const int axis : {0, 1, 2}) {
        Vector3d place(0.1, 0.1, 0.1);
        CHECK(eight.contains(place));
        place[axis] = kNone;
        CHECK(!eight.contains(place));
        place[axis] = std::numeric_limits<double>::infinity();
        CHECK(!eight.contains(place));
    }
}

TEST_CASE("what lies inside a torus of 200,000 triangles") {
    const ClosedMesh mesh = turned(make_torus(40, 15, 400, 250)).make();
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    std::mt19937 random(1);
    std::uniform_real_distribution<double> along(-60, 60);
    int inside = 0;
    for (int i = 0; i < 5000; ++i) {
        const Vector3d place(along(random), along(random), along(random) / 3);
        const double far = std::hypot(std::hypot(place.x(), place.y()) - 40, place.z());
        if (std::abs(far - 15) < 0.01) continue;
        inside += far < 15;
        CHECK(mesh.contains(turn * place) == (far < 15));
    }
    CHECK(inside > 500);
}

TEST_CASE("long thin triangles at an angle") {
    const double root = std::sqrt(0.5);
    const auto turn = [&](const Vector3d& v) -> Vector3d {
        return {root * (v.x() - v.y()), root * (v.x() + v.y()), v.z()};
    };
    TestMesh rake;
    for (int i = 0; i < 50; ++i)
        rake.join(make_box({i - 0.3, 0, 0}, {i + 0.3, 100, 1}).mapped(turn));
    const ClosedMesh mesh = rake.make();
    for (int i = 0; i < 50; ++i)
        for (const double along : {-0.1, 0.1, 30.0, 99.9, 100.1})
            for (const double side : {-0.31, -0.29, 0.29, 0.31})
                CHECK(mesh.contains(turn({i + side, along, 0.5})) ==
                      (along > 0 && along < 100 && std::abs(side) < 0.3));
}

TEST_CASE("a mesh beside the surface is refused") {
    const std::vector<defrec_surface_point> surface = make_surface({0, 0, 100}, 60, 70);
    const TestMesh slab = make_box({-40, -40, 0}, {40, 40, 30}, 2);
    CHECK(meeting(slab.moved({0, 0, 101}), surface) == "none");
    CHECK(meeting(slab.moved({0, 0, 90}), surface) == "none");
    CHECK(meeting(slab.moved({0, 0, 107.9}), surface) == "none");
    CHECK(has(meeting(slab.moved({0, 0, 108.1}), surface), "mesh lies beside the view: 0 % "));
    CHECK(has(meeting(slab.moved({0, 0, 150}), surface),
              "is 50 mm from the surface's (-30 -30 100)"));
    CHECK(meeting(slab.moved({37, 0, 90}), surface) == "none");
    CHECK(has(meeting(slab.moved({50, 0, 90}), surface), "within 8 mm, expected 50 %"));
    CHECK(has(meeting(slab.moved({50, 0, 90}), surface), "is 0 mm from"));
    // A tenth of the longest side.
    CHECK(meeting(make_box({-100, -100, 119}, {100, 100, 150}), surface) == "none");
    CHECK(has(meeting(make_box({-100, -100, 121}, {100, 100, 150}), surface), "within 20 mm"));
    // A thin sheet.
    CHECK(meeting(make_box({-40, -40, 103}, {40, 40, 103.1}), surface) == "none");
    CHECK(meeting(slab.moved({0, 0, 900}), {}) == "none");
}

TEST_CASE("a mesh beside the surface may be one in centimetres") {
    const std::vector<defrec_surface_point> surface = make_surface({0, 0, 100}, 60, 20);
    CHECK(has(meeting(make_box({-4, -4, 10.1}, {4, 4, 13}), surface),
              "look like centimetres: times 10 it would meet the surface"));
    CHECK(lacks(meeting(make_box({-40, -40, 300}, {40, 40, 330}), surface), "centimetres"));
    // Too large for one.
    CHECK(lacks(meeting(make_box({-110, -110, 130}, {110, 110, 350}).moved({0, 0, -340}), surface),
                "centimetres"));
}
