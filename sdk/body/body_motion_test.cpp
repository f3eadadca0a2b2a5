// Where a body is in a frame: rigid motions, loads with a known solution, what is held, stiff or
// cut, and what is not known.
#include "sdk/body/body_motion.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <optional>

#include "sdk/base/os/services.hpp"
#include "sdk/body/deep_motion.hpp"
#include "sdk/body/test_body.hpp"
#include "sdk/scenes/bodies/loaded_layer.hpp"

using namespace defrec;
using namespace defrec::test;
using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

const TestSurface& plane() {
    static const TestSurface surface = make_surface();
    return surface;
}
const std::shared_ptr<const Body>& plane_body() {
    static const std::shared_ptr<const Body> body = make_body(plane());
    return body;
}

MovedSurface::Place moved_as(const Isometry3d& motion) {
    return [motion](const Vector3d& rest, size_t) -> Vector3d { return motion * rest; };
}

// How far places are from where a rigid motion takes them, at most, mm.
double worst_of(const BodyMotion& motion, const Isometry3d& wanted,
                const std::vector<Vector3d>& places, uint8_t piece = 0) {
    double worst = 0;
    for (const Vector3d& place : places)
        worst = std::max(worst, (moved_by(motion, place, piece).place - wanted * place).norm());
    return worst;
}

// An elastic half-space that is pressed by 7 mm over 6 mm, or dragged along x, at the middle.
const cli::LoadedLayer& half_space() {
    static const cli::LoadedLayer layer({0.43, 0}, 6);
    return layer;
}
Vector3d loaded(const cli::BodyLoad& load, const Vector3d& rest, size_t layer) {
    return rest + half_space().displacement(load, rest.x(), rest.y(), layer);
}
cli::BodyLoad pressed() {
    cli::BodyLoad load;
    load.press = 7;
    return load;
}
cli::BodyLoad dragged() {
    cli::BodyLoad load;
    load.drag = {5, 0};
    return load;
}
MovedSurface loaded_frame(const cli::BodyLoad& load, const Isometry3d& motion) {
    return {plane(), [&](const Vector3d& rest, size_t) -> Vector3d {
                return motion * loaded(load, rest, 0);
            }};
}

// Which vertices of the plane are not known.
bool is_unknown(const Vector3d& rest, size_t) { return rest.x() > 0; }
MovedSurface half_unknown(const MovedSurface::Place& place) {
    MovedSurface frame(plane(), [&](const Vector3d& rest, size_t i) -> Vector3d {
        const auto k = static_cast<double>(i);
        return place(rest, i) + (is_unknown(rest, i)
                                     ? 20 * Vector3d(std::sin(7 * k), std::cos(3 * k), 0.6)
                                     : Vector3d::Zero().eval());
    });
    for (size_t i = 0; i < frame.errors.size(); ++i)
        if (is_unknown(plane().position(i), i)) frame.errors[i] = 5;
    return frame;
}

BodyDescription with_region(const Vector3d& low, const Vector3d& high, double stiffness,
                            bool is_held) {
    BodyDescription description;
    description.regions.push_back({box_mesh(low, high), stiffness, is_held});
    return description;
}

std::vector<float> all_moved(const std::shared_ptr<const Body>& body, const MovedSurface& frame,
                             const Services* helpers) {
    const BodyMotion motion(body, frame.view(), {}, helpers);
    std::vector<float> values;
    for (const Vector3d& place : places_beneath({0, 3, 12, 30})) {
        const BodyMotion::Moved moved = moved_by(motion, place);
        for (const double value : {moved.place.x(), moved.place.y(), moved.place.z(),
                                   moved.surface_mm2, moved.deformation_mm2, moved.shift_mm2,
                                   moved.choice_mm2, moved.evidence, moved.activity_mm2})
            values.push_back(static_cast<float>(value));
    }
    return values;
}

}  // namespace

TEST_CASE("what moves rigidly at the surface moves so beneath it, however far it turns") {
    const MovedSurface frame(plane(), moved_as(large_motion()));
    const BodyMotion motion(plane_body(), frame.view(), {}, nullptr);
    CHECK(worst_of(motion, large_motion(), places_beneath({-4, 0, 2, 10, 30, 44, 80})) < 1e-3);
    CHECK((motion.deep_motion(0).matrix() - large_motion().matrix()).norm() < 1e-3);
    for (const Vector3d& place : places_beneath({2, 20})) {
        const BodyMotion::Moved moved = moved_by(motion, place);
        CHECK(moved.evidence > 0.99);
        CHECK(moved.deformation_mm2 < 1e-5);
        CHECK(moved.shift_mm2 < 1e-5);
        CHECK(moved.choice_mm2 < 1e-5);
        CHECK(std::abs(std::sqrt(moved.surface_mm2) - 0.05) < 1e-3);
    }
    // Where nothing of the body is near.
    CHECK(worst_of(motion, large_motion(), {{0, 0, 3000}}) < 0.1);
}

TEST_CASE("a curved surface and a body with a mesh move rigidly with their surface as well") {
    const TestSurface bowl = make_surface(-0.006);
    BodyDescription description;
    description.mesh.emplace(box_mesh({-44, -33, kSurfaceZ - 16}, {44, 33, kSurfaceZ + 25}));
    const MovedSurface frame(bowl, moved_as(large_motion()));
    const BodyMotion motion(make_body(bowl, description), frame.view(), {}, nullptr);
    CHECK(worst_of(motion, large_motion(), places_beneath({0, 10, 24, 60})) < 1e-3);
}

TEST_CASE("each piece of a surface has a motion of its own") {
    TestSurface surface = plane();
    for (size_t i = 0; i < surface.vertices.size(); ++i)
        surface.piece[i] = surface.position(i).x() > 5 ? 1 : 0;
    surface.pieces = 2;
    const Isometry3d other = motion_of(-1.2, {1, 0.3, 0.2}, {-40, 5, 60});
    const MovedSurface frame(surface, [&](const Vector3d& rest, size_t i) -> Vector3d {
        return (surface.piece[i] == 0 ? large_motion() : other) * rest;
    });
    const BodyMotion motion(make_body(surface), frame.view(), {}, nullptr);
    std::vector<Vector3d> left, right;
    for (const Vector3d& place : places_beneath({1, 10, 30}))
        (place.x() > 5 ? right : left).push_back(place);
    CHECK(worst_of(motion, large_motion(), left, 0) < 1e-3);
    CHECK(worst_of(motion, other, right, 1) < 1e-3);
}

TEST_CASE("vertices that are not known do not pull, and points beneath them say so") {
    const MovedSurface frame = half_unknown(moved_as(large_motion()));
    const BodyMotion motion(plane_body(), frame.view(), {}, nullptr);
    CHECK(worst_of(motion, large_motion(), places_beneath({10, 20, 30})) < 0.05);
    CHECK(worst_of(motion, large_motion(), places_beneath({2})) < 0.05);
    CHECK(moved_by(motion, {-25, 0, kSurfaceZ + 4}).evidence > 0.9);
    CHECK(moved_by(motion, {25, 0, kSurfaceZ + 4}).evidence < 0.1);
    const double between = moved_by(motion, {0, 0, kSurfaceZ + 10}).evidence;
    CHECK(between > 0.2);
    CHECK(between < 0.8);
}

TEST_CASE("handles of which no vertex is known do not pull") {
    MovedSurface frame(plane(), moved_as(large_motion()));
    for (const Handle& handle : plane_body()->pieces()[0].handles()) {
        if (handle.position.x() < 0) continue;
        for (const uint32_t vertex : handle.vertices) {
            frame.errors[vertex] = 5;
            const auto k = static_cast<float>(vertex);
            frame.positions[3 * vertex] += 20 * std::sin(7 * k);
            frame.positions[3 * vertex + 2] += 12;
        }
    }
    const BodyMotion motion(plane_body(), frame.view(), {}, nullptr);
    CHECK(worst_of(motion, large_motion(), places_beneath({2, 10, 30})) < 0.05);
    // The surface's error is that of what is known of it.
    CHECK(std::abs(std::sqrt(moved_by(motion, {-25, 0, kSurfaceZ + 4}).surface_mm2) - 0.05) < 0.05);
}

TEST_CASE("where nothing is known evidence is next to nothing, and every number is one") {
    MovedSurface frame(plane(), moved_as(large_motion()));
    for (const float error : {5.0f, 100.0f, 1e6f}) {
        CAPTURE(error);
        std::fill(frame.errors.begin(), frame.errors.end(), error);
        const BodyMotion motion(plane_body(), frame.view(), {}, nullptr);
        for (const Vector3d& place : places_beneath({0, 10, 60})) {
            const BodyMotion::Moved moved = moved_by(motion, place);
            // The surface stays where it was.
            CHECK((moved.place - large_motion() * place).norm() < 0.1);
            CHECK(moved.surface_mm2 == doctest::Approx(double{error} * double{error}));
            CHECK(moved.evidence >= 0);
            CHECK(moved.evidence < 1e-3);
            for (const double value : {moved.surface_mm2, moved.deformation_mm2, moved.shift_mm2,
                                       moved.choice_mm2, moved.activity_mm2})
                CHECK(std::isfinite(value));
        }
    }
}

TEST_CASE("beneath a load the body moves as an elastic half-space does, also while it turns") {
    for (const bool is_press : {true, false})
        for (const Isometry3d& rigid : {Isometry3d(Isometry3d::Identity()), large_motion()}) {
            CAPTURE(is_press);
            const cli::BodyLoad load = is_press ? pressed() : dragged();
            const BodyMotion motion(plane_body(), loaded_frame(load, rigid).view(), {}, nullptr);
            for (size_t layer = 2; layer <= 5; ++layer) {
                const double depth = cli::kBodyDepths[layer];
                CAPTURE(depth);
                double worst = 0;
                for (const Vector3d& place : places_beneath({depth}, 10)) {
                    const Vector3d truth = rigid * loaded(load, place, layer);
                    worst = std::max(worst, (moved_by(motion, place).place - truth).norm());
                }
                CHECK(worst < (depth >= 10 ? 0.35 : 0.6));
            }
        }
}

TEST_CASE("a load of a part of the surface does not move what lies deep") {
    for (const bool is_press : {true, false}) {
        CAPTURE(is_press);
        const MovedSurface frame = loaded_frame(is_press ? pressed() : dragged(), large_motion());
        const BodyMotion motion(plane_body(), frame.view(), {}, nullptr);
        Eigen::Matrix3Xd rest(3, plane().vertices.size()), now = rest;
        for (size_t i = 0; i < plane().vertices.size(); ++i)
            for (int axis = 0; axis < 3; ++axis) {
                rest(axis, static_cast<Eigen::Index>(i)) = plane().position(i)[axis];
                now(axis, static_cast<Eigen::Index>(i)) =
                    static_cast<double>(frame.positions[3 * i + static_cast<size_t>(axis)]);
            }
        const Isometry3d mean = fit_rigid(rest, now, Eigen::VectorXd::Ones(rest.cols()));
        double worst = 0, worst_of_mean = 0;
        for (const Vector3d& place : places_beneath({0, 40})) {
            const Vector3d truth = large_motion() * place;
            worst = std::max(worst, (motion.deep_motion(0) * place - truth).norm());
            worst_of_mean = std::max(worst_of_mean, (mean * place - truth).norm());
        }
        CAPTURE(worst_of_mean);
        CHECK(worst < 0.8);
        CHECK(worst < 0.6 * worst_of_mean);
        CHECK(moved_by(motion, {0, 0, kSurfaceZ + 10}).deformation_mm2 > 0.3);
        CHECK(moved_by(motion, {0, 0, kSurfaceZ + 10}).shift_mm2 > 0.3);
    }
}

TEST_CASE("the data are followed at the surface") {
    const BodyMotion motion(plane_body(), loaded_frame(pressed(), large_motion()).view(), {},
                            nullptr);
    double worst = 0;
    for (const Handle& handle : plane_body()->pieces()[0].handles()) {
        Vector3d now = Vector3d::Zero();
        for (const uint32_t vertex : handle.vertices)
            now += large_motion() * loaded(pressed(), plane().position(vertex), 0);
        now /= static_cast<double>(handle.vertices.size());
        worst = std::max(worst, (moved_by(motion, handle.position).place - now).norm());
    }
    CHECK(worst < 0.6);
}

TEST_CASE("what is given to be held moves as it is told") {
    DeepKnowledge known;
    known.held = large_motion() * motion_of(0.03, {1, 0, 0}, {0, 0, 3});
    const MovedSurface frame(plane(), moved_as(large_motion()));
    const BodyMotion free(plane_body(), frame.view(), known, nullptr);
    CHECK((free.deep_motion(0).matrix() - known.held->matrix()).norm() == 0);
    // Farther down the body follows more of it.
    double before = 0;
    for (const double depth : {2.0, 15.0, 30.0, 44.0}) {
        const Vector3d place(0, 0, kSurfaceZ + depth);
        const double moved = (moved_by(free, place).place - large_motion() * place).norm();
        CHECK(moved > before);
        before = moved;
    }
    CHECK(before > 0.2);
    const std::vector<Vector3d> beyond{{0, 0, kSurfaceZ + 1000}};
    CHECK(moved_by(free, beyond[0]).choice_mm2 == 0);

    const std::shared_ptr<const Body> body = make_body(
        plane(), with_region({-50, -40, kSurfaceZ + 20}, {50, 40, kSurfaceZ + 60}, 1, true));
    const BodyMotion held(body, frame.view(), known, nullptr);
    CHECK(worst_of(held, *known.held, places_beneath({32, 40})) < 0.15);
    CHECK(worst_of(held, large_motion(), places_beneath({0})) < 0.2);
}

TEST_CASE("a stiff region moves nearly rigidly") {
    const Vector3d low(-9, -9, kSurfaceZ + 5), high(9, 9, kSurfaceZ + 23);
    const MovedSurface frame = loaded_frame(pressed(), large_motion());
    const auto strained = [&](const std::shared_ptr<const Body>& body) {
        const BodyMotion motion(body, frame.view(), {}, nullptr);
        double worst = 0;
        std::vector<Vector3d> rest, now;
        for (const double x : {-6.0, 0.0, 6.0})
            for (const double y : {-6.0, 0.0, 6.0})
                for (const double depth : {8.0, 14.0, 20.0}) {
                    rest.emplace_back(x, y, kSurfaceZ + depth);
                    now.push_back(moved_by(motion, rest.back()).place);
                }
        for (size_t i = 0; i < rest.size(); ++i)
            for (size_t k = 0; k < i; ++k)
                worst = std::max(worst,
                                 std::abs((rest[i] - rest[k]).norm() - (now[i] - now[k]).norm()));
        return worst;
    };
    const double soft = strained(plane_body()),
                 stiff = strained(make_body(plane(), with_region(low, high, 200, false)));
    CHECK(soft > 0.6);
    CHECK(stiff < 0.15 * soft);
}

namespace {

// A cut of 10 mm through the middle of the plane whose sides move apart by 4 mm.
class OpenedCut {
  public:
    explicit OpenedCut(double turn, const Vector3d& middle = {0.7, 0.4, kSurfaceZ},
                       bool is_known = true)
        : middle_(middle),
          along_(std::sin(turn), std::cos(turn), 0),
          across_(std::cos(turn), -std::sin(turn), 0) {
        TestSurface surface = plane();
        if (is_known) surface.cut(middle - 80 * along_, middle + 80 * along_);
        const MovedSurface frame(surface, [&](const Vector3d& rest, size_t) -> Vector3d {
            return rest + ((rest - middle).dot(across_) > 0 ? 2 : -2) * across_;
        });
        motion_.emplace(make_body(surface), frame.view(), DeepKnowledge{}, nullptr);
    }
    // By how much points at that depth move apart that lie 4 mm on either side, at least, mm.
    double opening(double depth) const {
        double least = 1e9;
        for (const double at : {-10.0, 0.0, 9.0}) {
            const Vector3d place = middle_ + at * along_ + Vector3d(0, 0, depth);
            const Vector3d one = moved_by(*motion_, place + 4 * across_).place,
                           other = moved_by(*motion_, place - 4 * across_).place;
            least = std::min(least, across_.dot(one - other) - 8);
        }
        return least;
    }

  private:
    Vector3d middle_, along_, across_;
    std::optional<BodyMotion> motion_;
};

}  // namespace

TEST_CASE("a cut parts the body as deep as it is") {
    const OpenedCut cut(0);
    CHECK(cut.opening(1) > 3.2);
    CHECK(cut.opening(4) > 2.3);
    CHECK(cut.opening(30) < 1);
    const OpenedCut unknown(0, {0.7, 0.4, kSurfaceZ}, false);
    CHECK(cut.opening(6) > unknown.opening(6) + 0.6);
}

TEST_CASE("a cut parts the body wherever it lies between the cells") {
    for (const double x : {1.1, 3.3}) {
        CAPTURE(x);
        CHECK(OpenedCut(0, {x, 0.4, kSurfaceZ}).opening(4) > 2.3);
    }
}

TEST_CASE("a cut parts the body whatever its direction") {
    for (const double turn : {0.35, 0.785398}) {
        CAPTURE(turn);
        const OpenedCut cut(turn);
        CHECK(cut.opening(1) > 3);
        CHECK(cut.opening(4) > 2.3);
        CHECK(cut.opening(30) < 1);
    }
}

TEST_CASE("two runs give the same bits, with and without threads that help") {
    defrec_context_desc desc{};
    desc.threads = 3;
    const Services services(desc);
    const MovedSurface frame = half_unknown([](const Vector3d& rest, size_t) -> Vector3d {
        return large_motion() * loaded(pressed(), rest, 0);
    });
    const std::vector<float> once = all_moved(plane_body(), frame, nullptr);
    const std::shared_ptr<const Body> again = make_body(plane());
    for (const auto& body : {plane_body(), again})
        for (const Services* helpers : {static_cast<const Services*>(nullptr), &services}) {
            const std::vector<float> other = all_moved(body, frame, helpers);
            REQUIRE(other.size() == once.size());
            CHECK(std::memcmp(once.data(), other.data(), once.size() * sizeof(float)) == 0);
        }
}

TEST_CASE("a surface that has grown moves the body of the one before") {
    TestSurface grown = plane();
    for (double y = -26; y <= 26; y += 2) grown.add({60, y, kSurfaceZ}, {0, 0, -1});
    const MovedSurface frame(grown, moved_as(large_motion()));
    const BodyMotion motion(plane_body(), frame.view(), {}, nullptr);
    CHECK(worst_of(motion, large_motion(), places_beneath({2, 10})) < 1e-3);
}

TEST_CASE(
    "a camera's pose tells what lies deep where a load is too wide to be told from a motion") {
    const cli::LoadedLayer wide({0.43, 0}, 22);
    cli::BodyLoad load;
    load.press = 6;
    const MovedSurface frame(plane(), [&](const Vector3d& rest, size_t) -> Vector3d {
        return large_motion() * (rest + wide.displacement(load, rest.x(), rest.y(), 0));
    });
    const auto error_with = [&](const DeepKnowledge& known) {
        const BodyMotion motion(plane_body(), frame.view(), known, nullptr);
        double worst = 0;
        for (const Vector3d& place : places_beneath({40}))
            worst =
                std::max(worst, (motion.deep_motion(0) * place - large_motion() * place).norm());
        return worst;
    };
    DeepKnowledge known;
    known.expected = large_motion();
    const double without = error_with({}), with = error_with(known);
    MESSAGE(without, " mm without, ", with, " mm with the pose");
    CHECK(with < 0.9 * without);
}
