// Bodies made of surfaces, and where points lie with respect to them.
#include "sdk/body/body.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numeric>
#include <string>

#include "sdk/base/util/error.hpp"
#include "sdk/body/body_shape.hpp"
#include "sdk/body/test_body.hpp"

using namespace defrec;
using namespace defrec::test;
using Eigen::Vector3d;

namespace {

const Body& plane_body() {
    static const std::shared_ptr<const Body> body = make_body(make_surface());
    return *body;
}

}  // namespace

TEST_CASE("each vertex belongs to one handle of its piece, but for those that a cut passes") {
    TestSurface surface = make_surface(0.003);
    for (size_t i = 0; i < surface.vertices.size(); ++i)
        surface.piece[i] = surface.position(i).x() > 9 ? 1 : 0;
    surface.pieces = 2;
    surface.cut({-20, -30, kSurfaceZ}, {-20, 10, kSurfaceZ});
    constexpr double kStep = 5;
    const std::vector<std::vector<Handle>> handles = make_handles(surface.view(), kStep);
    REQUIRE(handles.size() == 2);
    std::vector<int> count(surface.vertices.size(), 0);
    for (size_t piece = 0; piece < 2; ++piece)
        for (const Handle& handle : handles[piece]) {
            REQUIRE(!handle.vertices.empty());
            Vector3d mean = Vector3d::Zero();
            for (const uint32_t vertex : handle.vertices) {
                ++count[vertex];
                CHECK(surface.piece[vertex] == piece);
                CHECK((surface.position(vertex) - handle.position).norm() < 1.5 * kStep);
                mean += surface.position(vertex);
            }
            mean /= static_cast<double>(handle.vertices.size());
            CHECK((mean - handle.position).norm() < 1e-5);
            CHECK(std::abs(handle.normal.norm() - 1) < 1e-6);
            CHECK(handle.normal.z() < -0.8);
        }
    for (size_t i = 0; i < count.size(); ++i) {
        const Vector3d place = surface.position(i);
        const bool is_cut = std::abs(place.x() + 20) < 2 && std::abs(place.y()) < 10;
        if (is_cut) CHECK(count[i] == 0);
        if (std::abs(place.x() + 20) > 3 || place.y() > 13) CHECK(count[i] == 1);
    }
}

TEST_CASE("the step of handles follows the surface's size, so that there are about as many") {
    for (const double size : {15.0, 52.0, 150.0}) {
        CAPTURE(size);
        const TestSurface surface = make_surface(0, size / 50, size, size);
        const double step = handle_step(surface.view());
        const size_t count = make_handles(surface.view(), step)[0].size();
        CHECK(count >= 120);
        CHECK(count <= 280);
    }
}

TEST_CASE("a point of a body has its depth, its place, and handles whose weights add up to 1") {
    const Body& body = plane_body();
    REQUIRE(body.pieces().size() == 1);
    CHECK(body.vertices() == make_surface().vertices.size());
    for (const Vector3d& place : places_beneath({-3, 0, 2, 10, 30})) {
        const BodyPoint point = body.find(place, 0);
        CHECK(std::abs(point.depth_mm - (place.z() - kSurfaceZ)) < 1e-3);
        REQUIRE(point.place.cell >= 0);
        CHECK(point.beyond_mm < (point.depth_mm < 0 ? 6 : 1e-6));
        double sum = 0, nearest = 1e9;
        for (const Handle& handle : body.pieces()[0].handles())
            nearest = std::min(nearest, (handle.position - place).norm());
        for (size_t k = 0; k < BodyPoint::kHandles; ++k) {
            CHECK(point.weight[k] >= 0);
            sum += static_cast<double>(point.weight[k]);
        }
        CHECK(std::abs(sum - 1) < 1e-5);
        const Handle& first = body.pieces()[0].handles()[static_cast<size_t>(point.handle[0])];
        CHECK(std::abs((first.position - place).norm() - nearest) < 1e-9);
        CHECK(point.weight[0] >= point.weight[3]);
    }
    // Beyond it, and so far away that nothing is near.
    const BodyPoint beyond = body.find({0, 0, kSurfaceZ + 120}, 0);
    REQUIRE(beyond.place.cell >= 0);
    CHECK(beyond.beyond_mm > 40);
    CHECK(beyond.beyond_mm < 80);
    CHECK(body.find({0, 0, 1e6}, 0).place.cell == -1);
    CHECK(body.find({1e300, 0, 0}, 0).place.cell == -1);
}

TEST_CASE("a body reaches beneath all of its surface, and so deep as plans lie") {
    for (const Vector3d& place : places_beneath({1, 20, 43}, 1))
        CHECK(plane_body().find(place, 0).beyond_mm < 1e-6);
}

TEST_CASE("responses of handles and supports make rigid motions exact to first order") {
    const BodyPiece& piece = plane_body().pieces()[0];
    const size_t nodes = piece.lattice().free_nodes();
    // Displacements a x + b: shifts, and turns.
    std::vector<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> motions;
    for (int axis = 0; axis < 3; ++axis) {
        motions.emplace_back(Eigen::Matrix<double, 3, 4, Eigen::RowMajor>::Zero())(axis, 3) = 1;
        auto& turn = motions.emplace_back(Eigen::Matrix<double, 3, 4, Eigen::RowMajor>::Zero());
        turn((axis + 1) % 3, (axis + 2) % 3) = 0.01;
        turn((axis + 2) % 3, (axis + 1) % 3) = -0.01;
    }
    for (const auto& motion : motions) {
        const Eigen::Matrix<float, 12, 1> affine =
            Eigen::Map<const Eigen::Matrix<double, 12, 1>>(motion.data()).cast<float>();
        double worst = 0;
        for (size_t node = 0; node < nodes; ++node) {
            Eigen::Vector3f moved =
                piece.support_response().middleRows<3>(3 * static_cast<Eigen::Index>(node)) *
                affine;
            for (const BodyPiece::Link& link : piece.links(node))
                moved += link.response *
                         (motion *
                          piece.handles()[static_cast<size_t>(link.handle)].position.homogeneous())
                             .cast<float>();
            const Vector3d wanted = motion * piece.lattice().nodes()[node].homogeneous();
            worst = std::max(worst, (moved.cast<double>() - wanted).norm());
        }
        CHECK(worst < 0.03);
    }
    for (size_t node = 0; node < nodes; ++node) {
        float influence = 0;
        for (const BodyPiece::Link& link : piece.links(node)) influence += link.influence;
        CHECK(std::abs(influence - 1) < 1e-3f);
        CHECK(piece.support_share(node) >= 0);
        CHECK(piece.support_share(node) <= 1);
    }
}

TEST_CASE("a body that nobody wants any more is given up") {
    int asked = 0;
    CHECK(Body::make(make_surface().view(), {}, [&] { return ++asked < 3; }) == nullptr);
    CHECK(asked == 4);  // of the lattice, and once more of what is made on it
}

TEST_CASE("a surface of few vertices has a body, a piece without any has none") {
    for (const double spacing : {72.0, 26.0, 10.0}) {
        CAPTURE(spacing);
        const TestSurface surface = make_surface(0, spacing);
        const std::shared_ptr<const Body> body = make_body(surface);
        REQUIRE(body != nullptr);
        const MovedSurface frame(surface, [](const Vector3d& rest, size_t) -> Vector3d {
            return rest + Vector3d(1, 2, 3);
        });
        const BodyMotion motion(body, frame.view(), {}, nullptr);
        for (const Vector3d& place : places_beneath({3, 20}))
            CHECK((moved_by(motion, place).place - place - Vector3d(1, 2, 3)).norm() < 1e-2);
    }
    TestSurface surface = make_surface();
    surface.pieces = 2;
    std::string words = "none";
    try {
        make_body(surface);
    } catch (const Error& error) {
        CHECK(error.status() == DEFREC_ERROR_UNSUPPORTED);
        words = error.what();
    }
    CHECK(words.find("piece 1") != std::string::npos);
}

TEST_CASE("a mesh bounds the body") {
    BodyDescription description;
    description.mesh.emplace(box_mesh({-40, -30, kSurfaceZ - 1}, {40, 30, kSurfaceZ + 22}));
    const std::shared_ptr<const Body> body = make_body(make_surface(), description);
    REQUIRE(body != nullptr);
    CHECK(body->find({0, 0, kSurfaceZ + 20}, 0).beyond_mm < 1e-6);
    CHECK(body->find({0, 0, kSurfaceZ + 40}, 0).beyond_mm > 10);
    CHECK(body->find({60, 0, kSurfaceZ + 10}, 0).beyond_mm > 10);
}
