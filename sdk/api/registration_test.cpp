// Registration of a model through the C API: what it gives, what is refused with which words. How
// exact it is: sdk/registration.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "sdk/registration/test_organ.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec::test;
using defrec::Pose;

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

template <class Struct>
Struct init() {
    Struct made;
    DEFREC_INIT(&made);
    return made;
}

// A handle that ends itself.
class TestRegistration {
  public:
    TestRegistration() = default;
    ~TestRegistration() { defrec_registration_destroy(handle_); }
    TestRegistration(const TestRegistration&) = delete;
    TestRegistration& operator=(const TestRegistration&) = delete;

    defrec_registration* out() { return &handle_; }
    defrec_registration get() const { return handle_; }
    defrec_registration_info info() const {
        auto made = init<defrec_registration_info>();
        REQUIRE_OK(defrec_registration_get(handle_, &made));
        return made;
    }

  private:
    defrec_registration handle_ = nullptr;
};

void write_pose(const Pose& pose, double* values) {
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            values[4 * row + column] = pose.rotation(row, column);
        values[4 * row + 3] = pose.translation[row];
    }
}

Eigen::Vector3d moved_by(const double* transform, const Eigen::Vector3d& place) {
    Eigen::Vector3d made;
    for (int row = 0; row < 3; ++row)
        made[row] = transform[4 * row] * place.x() + transform[4 * row + 1] * place.y() +
                    transform[4 * row + 2] * place.z() + transform[4 * row + 3];
    return made;
}

// Pairs with errors of 0.5 mm where they were seen.
struct Pairs {
    std::vector<double> model, seen, covariance;
    Pose truth{defrec::rotation_of({0.4, -0.2, 1.1}), {20, -5, 90}};

    explicit Pairs(const std::vector<Eigen::Vector3d>& places) {
        for (const Eigen::Vector3d& place : places) {
            const Eigen::Vector3d there = truth * place;
            model.insert(model.end(), place.data(), place.data() + 3);
            seen.insert(seen.end(), there.data(), there.data() + 3);
            covariance.insert(covariance.end(), {0.25, 0, 0, 0.25, 0, 0.25});
        }
    }
    defrec_registration_pairs desc() const {
        auto made = init<defrec_registration_pairs>();
        made.model_xyz = model.data();
        made.seen_xyz = seen.data();
        made.seen_covariance = covariance.data();
        made.count = model.size() / 3;
        return made;
    }
};

Pairs five_pairs() {
    return Pairs({{0, 0, -50}, {60, 10, -30}, {-40, 30, -35}, {10, -45, -20}, {-70, -10, -20}});
}

// An organ and what a camera sees of it; the start is off by up to 14 degrees and 15 mm.
struct Scene {
    defrec::TestMesh mesh;
    Pose truth;
    defrec::TestView view;
    double start[12];

    explicit Scene(const defrec::TestMesh& its_mesh) : mesh(its_mesh) {
        std::mt19937 random(7);
        truth = defrec::organ_pose(random, 110, 0.3);
        view = defrec::TestCamera(mesh, truth, {}).view(mesh, random);
        write_pose(defrec::off_by(truth, {0, 0, 0}, 0.25, 15, random), start);
    }
    defrec_registration_desc desc() const {
        auto made = init<defrec_registration_desc>();
        made.model_vertices = mesh.vertices.data();
        made.model_vertex_count = mesh.vertices.size() / 3;
        made.model_triangles = mesh.triangles.data();
        made.model_triangle_count = mesh.triangles.size() / 3;
        made.seen_vertices = view.places.data();
        made.seen_covariances = view.covariances.data();
        made.seen_count = view.places.size() / 3;
        std::memcpy(made.start, start, sizeof start);
        return made;
    }
};

const Scene& organ() {
    static const Scene made(defrec::organ_mesh(4));
    return made;
}

// The error message of a call that is refused as an argument, and makes nothing.
std::string refusal(defrec_status status, defrec_registration made) {
    CHECK(status == DEFREC_ERROR_ARGUMENT);
    CHECK(made == nullptr);
    return defrec_last_error();
}

}  // namespace

TEST_CASE("pairs: the transform, and errors of targets that follow from it") {
    const Pairs pairs = five_pairs();
    const defrec_registration_pairs desc = pairs.desc();
    TestRegistration registration;
    REQUIRE_OK(defrec_registration_from_pairs(&desc, registration.out()));
    const defrec_registration_info info = registration.info();
    CHECK(info.verdict == DEFREC_VERDICT_ACCEPTED);
    CHECK(std::string(info.reason).size() > 10);
    CHECK(info.point_count == 5);
    CHECK(info.used == 5);
    CHECK(info.triangles == nullptr);
    CHECK(info.triangle_count == 0);
    for (size_t i = 0; i < 5; ++i) {
        CHECK(info.residuals[i] < 1e-6F);
        CHECK(info.inliers[i] == 1);
    }
    double xyz[6] = {0, 0, -40, 300, 0, 0}, covariance[12], error[2];
    REQUIRE_OK(defrec_registration_move_points(registration.get(), xyz, 2, xyz, covariance, error));
    CHECK((Eigen::Map<Eigen::Vector3d>(xyz) - pairs.truth * Eigen::Vector3d(0, 0, -40)).norm() <
          1e-9);
    // Five places, each to 0.5 mm along each axis: their middle is known to 0.39 mm.
    CHECK(error[0] == doctest::Approx(0.5 * std::sqrt(3.0 / 5)).epsilon(0.4));
    CHECK(error[1] > 3 * error[0]);  // far from them a turn counts
    CHECK(error[1] == doctest::Approx(std::sqrt(covariance[6] + covariance[9] + covariance[11])));
    // J C J^T with J = [-[x] 1].
    const Eigen::Map<const Eigen::Vector3d> x(xyz + 3);
    Eigen::Matrix<double, 3, 6> shift;
    shift << 0, x.z(), -x.y(), 1, 0, 0, -x.z(), 0, x.x(), 0, 1, 0, x.y(), -x.x(), 0, 0, 0, 1;
    const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> whole(info.covariance);
    CHECK((shift * whole * shift.transpose())(0, 1) == doctest::Approx(covariance[7]));
}

TEST_CASE("row 172: pairs in a line leave a turn open, through the C API as well") {
    const Pairs pairs({{0, 0, 0}, {20, 0, 0}, {40, 0, 0}, {70, 0, 0}});
    const defrec_registration_pairs desc = pairs.desc();
    TestRegistration registration;
    REQUIRE_OK(defrec_registration_from_pairs(&desc, registration.out()));
    CHECK(registration.info().verdict == DEFREC_VERDICT_UNDETERMINED);
    REQUIRE(registration.info().free_motion_count == 1);
    auto motion = init<defrec_free_motion>();
    REQUIRE_OK(defrec_registration_get_free_motion(registration.get(), 0, &motion));
    CHECK(motion.kind == DEFREC_FREE_TURN);
    const Eigen::Vector3d axis = pairs.truth.rotation.col(0);
    CHECK(std::abs(axis.dot(Eigen::Map<Eigen::Vector3d>(motion.axis))) > 0.999);
    CHECK(contains(motion.text, "turn about the axis"));
    CHECK(motion.expected_rad == 0);
    const double beside[3] = {30, 40, 0};
    double xyz[3], error = 0;
    REQUIRE_OK(
        defrec_registration_move_points(registration.get(), beside, 1, xyz, nullptr, &error));
    CHECK(error > 100);  // no target looks safe
    motion = init<defrec_free_motion>();
    CHECK(defrec_registration_get_free_motion(registration.get(), 1, &motion) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "index is 1, there are 1 free motions"));
    CHECK(motion.text == nullptr);
}

TEST_CASE("a surface: status, residuals per point, other threads, the model turned outwards") {
    Scene scene(defrec::organ_mesh(4));
    const size_t count = scene.view.places.size() / 3;
    std::vector<uint8_t> status(count, DEFREC_POINT_OBSERVED);
    for (size_t i = 7; i < count; i += 50) {
        status[i] = i % 100 == 7 ? DEFREC_POINT_EXTRAPOLATED : DEFREC_POINT_UNKNOWN;
        scene.view.places[3 * i + 2] += 40;  // would be far off
    }
    for (size_t i = 0; i < scene.mesh.triangles.size(); i += 3)
        std::swap(scene.mesh.triangles[i], scene.mesh.triangles[i + 1]);
    defrec_registration_desc desc = scene.desc();
    desc.seen_status = status.data();
    const TestContext alone({}, 1), shared({}, 3);
    TestRegistration registration, again;
    REQUIRE_OK(defrec_registration_from_surface(alone.get(), &desc, registration.out()));
    REQUIRE_OK(defrec_registration_from_surface(shared.get(), &desc, again.out()));
    const defrec_registration_info info = registration.info();
    CHECK(info.verdict == DEFREC_VERDICT_ACCEPTED);
    CHECK((moved_by(info.transform, {0, 0, 0}) - scene.truth * Eigen::Vector3d(0, 0, 0)).norm() <
          0.5);
    CHECK(std::memcmp(info.transform, again.info().transform, sizeof info.transform) == 0);
    CHECK(std::memcmp(info.covariance, again.info().covariance, sizeof info.covariance) == 0);
    REQUIRE(info.point_count == count);
    size_t inliers = 0;
    for (size_t i = 0; i < count; ++i) {
        if (status[i] != DEFREC_POINT_OBSERVED) {
            CHECK(std::isnan(info.residuals[i]));
            CHECK(info.inliers[i] == 0);
        }
        inliers += info.inliers[i];
    }
    CHECK(static_cast<double>(inliers) > 0.8 * static_cast<double>(count));
    CHECK(info.model_turned == 1);
    CHECK(info.model_has_outside == 1);
    REQUIRE(info.triangle_count == scene.mesh.triangles.size() / 3);
    CHECK(info.triangles[0] == organ().mesh.triangles[0]);
    CHECK(info.free_motion_count == 0);
}

TEST_CASE("row 175: a surface that fits in several ways: the other poses") {
    // An ellipsoid is the same after half a turn.
    Scene scene(defrec::sphere_mesh(4, [](const Eigen::Vector3d& d) {
        return Eigen::Vector3d(60 * d.x(), 40 * d.y(), 30 * d.z());
    }));
    defrec_registration_desc desc = scene.desc();
    desc.max_turn_rad = 3.1;
    desc.starts = 200;
    const TestContext context({}, 2);
    TestRegistration registration;
    REQUIRE_OK(defrec_registration_from_surface(context.get(), &desc, registration.out()));
    const defrec_registration_info info = registration.info();
    CHECK(info.verdict == DEFREC_VERDICT_AMBIGUOUS);
    REQUIRE(info.alternative_count > 0);
    auto other = init<defrec_registration_alternative>();
    REQUIRE_OK(defrec_registration_get_alternative(registration.get(), 0, &other));
    CHECK(other.distance_mm > 3);
    CHECK(other.rms_mm < 1);
    CHECK((moved_by(other.transform, {60, 0, 0}) - moved_by(info.transform, {60, 0, 0})).norm() >
          3);
    CHECK(defrec_registration_get_alternative(registration.get(), info.alternative_count, &other) ==
          DEFREC_ERROR_ARGUMENT);
}

TEST_CASE("row 176: a surface of something else gives a handle that says so") {
    std::vector<float> waves;
    for (int i = 0; i < 400; ++i) {
        const auto x = static_cast<float>(3 * (i % 20) - 30),
                   y = static_cast<float>(3 * (i / 20) - 30);
        waves.insert(waves.end(), {x, y, 80 + 6 * std::sin(0.3F * x)});
    }
    defrec_registration_desc desc = organ().desc();
    desc.seen_vertices = waves.data();
    desc.seen_covariances = nullptr;
    desc.seen_count = waves.size() / 3;
    const TestContext context;
    TestRegistration registration;
    REQUIRE_OK(defrec_registration_from_surface(context.get(), &desc, registration.out()));
    CHECK(registration.info().verdict == DEFREC_VERDICT_FAILED);
    CHECK(contains(registration.info().reason, "no pose fits"));
}

TEST_CASE("a model is registered to a template, whose surface it is") {
    TrackingSession session;
    const Pair pair = render(0, 0);
    defrec_job job = nullptr;
    REQUIRE_OK(session.submit({{pair.left.data()}, {pair.right.data()}, {}}, &job));
    take_result(job);
    defrec_template surface = nullptr;
    REQUIRE_OK(defrec_tracker_get_template(session.tracker, &surface));
    // The plane that the template shows, as a model: nothing tells where it lies along itself.
    std::vector<float> vertices;
    for (const float y : {-60.F, 60.F})
        for (const float x : {-60.F, 60.F})
            vertices.insert(vertices.end(),
                            {x, y, static_cast<float>(kDepth + kSlope * double{x})});
    const std::vector<uint32_t> triangles{0, 2, 1, 1, 2, 3};
    auto desc = init<defrec_registration_desc>();
    desc.model_vertices = vertices.data();
    desc.model_vertex_count = 4;
    desc.model_triangles = triangles.data();
    desc.model_triangle_count = 2;
    TestRegistration registration;
    REQUIRE_OK(
        defrec_registration_from_template(session.context, surface, &desc, registration.out()));
    const defrec_registration_info info = registration.info();
    INFO(info.reason);
    CHECK(info.verdict == DEFREC_VERDICT_UNDETERMINED);
    CHECK(info.free_motion_count == 3);
    CHECK(info.rms_mm < 0.3);
    CHECK(info.open_edges == 4);
    auto described = init<defrec_template_info>();
    REQUIRE_OK(defrec_template_get(surface, &described));
    CHECK(info.point_count == described.vertex_count);
    CHECK(info.used > 50);

    desc.seen_vertices = vertices.data();
    desc.seen_count = 4;
    defrec_registration none = nullptr;
    CHECK(contains(
        refusal(defrec_registration_from_template(session.context, surface, &desc, &none), none),
        "desc.seen_count is 4"));
    CHECK(defrec_registration_from_template(session.context, nullptr, &desc, &none) ==
          DEFREC_ERROR_ARGUMENT);
    defrec_template_release(surface);
}

TEST_CASE("row 193: a model that is not closed is not deformed, and is registered without") {
    Scene scene(defrec::organ_mesh(3));
    scene.mesh.triangles.resize(scene.mesh.triangles.size() - 30);
    defrec_registration_desc desc = scene.desc();
    desc.flags = DEFREC_REGISTRATION_ELASTIC;
    const TestContext context({}, 2);
    defrec_registration none = nullptr;
    CHECK(contains(refusal(defrec_registration_from_surface(context.get(), &desc, &none), none),
                   "the model is not closed"));
    desc.flags = 0;
    TestRegistration registration;
    REQUIRE_OK(defrec_registration_from_surface(context.get(), &desc, registration.out()));
    CHECK(registration.info().deformation == DEFREC_DEFORMATION_NOT_ASKED);
    CHECK(std::string(registration.info().deformation_text).empty());
}

TEST_CASE("row 194: an organ that has not changed its shape: the rigid motion, and why") {
    defrec_registration_desc desc = organ().desc();
    const TestContext context({}, 2);
    TestRegistration rigid, elastic;
    REQUIRE_OK(defrec_registration_from_surface(context.get(), &desc, rigid.out()));
    desc.flags = DEFREC_REGISTRATION_ELASTIC;
    REQUIRE_OK(defrec_registration_from_surface(context.get(), &desc, elastic.out()));
    const defrec_registration_info info = elastic.info();
    CHECK(info.verdict == DEFREC_VERDICT_ACCEPTED);
    CHECK(info.deformation == DEFREC_DEFORMATION_REFUSED);
    CHECK(contains(info.deformation_text, "the rigid motion explains the surface as well"));
    CHECK(info.deformed_max_mm == 0);
    CHECK(info.rigid_rms_mm == info.rms_mm);
    CHECK(std::memcmp(info.transform, rigid.info().transform, sizeof info.transform) == 0);
    const double target[3] = {10, 5, 40};
    double one[3], other[3], error = 0, doubtful = 0;
    REQUIRE_OK(defrec_registration_move_points(rigid.get(), target, 1, one, nullptr, &error));
    REQUIRE_OK(
        defrec_registration_move_points(elastic.get(), target, 1, other, nullptr, &doubtful));
    for (int axis = 0; axis < 3; ++axis) CHECK(one[axis] == doctest::Approx(other[axis]));
    CHECK(doubtful > error);
}

TEST_CASE("row 189: arrays that are missing, numbers out of range, counts that are too large") {
    const TestContext context;
    using Change = std::function<void(defrec_registration_desc&)>;
    const auto refused = [&](const Change& change) {
        defrec_registration_desc desc = organ().desc();
        change(desc);
        defrec_registration made = nullptr;
        return refusal(defrec_registration_from_surface(context.get(), &desc, &made), made);
    };
    using Desc = defrec_registration_desc;
    const std::vector<std::pair<Change, const char*>> cases = {
        {[](Desc& d) { d.flags = 4; }, "desc.flags is 4"},
        {[](Desc& d) { d.model_vertices = nullptr; }, "desc.model_vertices is NULL"},
        {[](Desc& d) { d.model_triangles = nullptr; }, "desc.model_triangles is NULL"},
        {[](Desc& d) { d.seen_vertices = nullptr; }, "desc.seen_vertices is NULL"},
        {[](Desc& d) { d.model_vertex_count = 2; }, "desc.model_vertex_count is 2"},
        {[](Desc& d) { d.model_vertex_count = UINT64_MAX; }, "desc.model_vertex_count is"},
        {[](Desc& d) { d.model_triangle_count = 2000001; }, "desc.model_triangle_count is 2000001"},
        {[](Desc& d) { d.seen_count = UINT64_MAX; }, "desc.seen_count is"},
        {[](Desc& d) { d.seen_count = 0; }, "0 points of the surface were given"},
        {[](Desc& d) { d.start[0] = 2; }, "the start is no rigid motion"},
        {[](Desc& d) { d.start[3] = kNaN; }, "the start is no rigid motion"},
        {[](Desc& d) { d.viewer[1] = kNaN; }, "the camera's place is not finite"},
        {[](Desc& d) { d.max_turn_rad = 4; }, "desc.max_turn_rad is 4"},
        {[](Desc& d) { d.max_shift_mm = -1; }, "desc.max_shift_mm is -1"},
        {[](Desc& d) { d.point_error_mm = kNaN; }, "desc.point_error_mm is nan"},
        {[](Desc& d) { d.model_error_mm = 101; }, "desc.model_error_mm is 101"},
        {[](Desc& d) { d.min_inlier_share = 2; }, "desc.min_inlier_share is 2"},
        {[](Desc& d) { d.max_error_mm = 1e-9; }, "desc.max_error_mm is 1e-09"},
        {[](Desc& d) { d.starts = 10001; }, "desc.starts is 10001"},
        {[](Desc& d) { d.deformation_mm = 101; }, "desc.deformation_mm is 101"},
    };
    for (const auto& [change, said] : cases) {
        const std::string message = refused(change);
        CHECK_MESSAGE(contains(message, said), message);
    }
    Scene bad = organ();
    bad.mesh.vertices[4] = kNaN;
    CHECK(contains(refused([&](Desc& d) { d.model_vertices = bad.mesh.vertices.data(); }),
                   "the model: vertex 1 is"));
    bad.mesh.triangles[5] = 1000000;
    CHECK(contains(refused([&](Desc& d) { d.model_triangles = bad.mesh.triangles.data(); }),
                   "the model: triangle 1 has vertex 1000000"));
    bad.view.places[5] = kNaN;
    CHECK(contains(refused([&](Desc& d) { d.seen_vertices = bad.view.places.data(); }),
                   "point 1 has a coordinate that is not finite"));
    const std::vector<uint8_t> unknown(bad.view.places.size() / 3, 99);
    CHECK(contains(refused([&](Desc& d) { d.seen_status = unknown.data(); }),
                   "0 of the " + std::to_string(unknown.size()) +
                       " points of the surface were observed, expected 50 at least"));
    bad.view.places[5] = 3e38f;
    CHECK(contains(refused([&](Desc& d) { d.seen_vertices = bad.view.places.data(); }),
                   "point 1: a coordinate is 3e+38 mm from 0, expected 1e+06 at most"));
    const std::vector<float> one_place(organ().mesh.vertices.size(), 0.001f);
    CHECK(contains(refused([&](Desc& d) { d.model_vertices = one_place.data(); }),
                   "triangles has an area, expected the surface of an organ"));
    auto desc = organ().desc();
    desc.struct_size = 3;
    defrec_registration made = nullptr;
    CHECK(defrec_registration_from_surface(context.get(), &desc, &made) == DEFREC_ERROR_VERSION);
    CHECK(defrec_registration_from_surface(context.get(), nullptr, &made) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_registration_from_surface(nullptr, &desc, &made) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_registration_from_surface(context.get(), &desc, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(made == nullptr);
}

TEST_CASE("row 189: pairs that are missing, too few, not finite, or have half of their errors") {
    using Change = std::function<void(defrec_registration_pairs&)>;
    const Pairs pairs = five_pairs();
    Pairs bad = pairs;
    bad.seen[4] = kNaN;
    bad.covariance[0] = -1;
    Pairs far = pairs, vague = pairs;
    far.model[7] = -1e150;
    far.seen[5] = 1.1e6;
    for (const size_t diagonal : {6, 9, 11}) vague.covariance[diagonal] = 1e300;
    std::vector<double> half = pairs.covariance;
    std::fill(half.begin(), half.begin() + 12, 0.0);
    using Desc = defrec_registration_pairs;
    const std::vector<std::pair<Change, const char*>> cases = {
        {[](Desc& d) { d.flags = 1; }, "desc.flags is 1"},
        {[](Desc& d) { d.model_xyz = nullptr; }, "desc.model_xyz is NULL"},
        {[](Desc& d) { d.seen_xyz = nullptr; }, "desc.seen_xyz is NULL"},
        {[](Desc& d) { d.count = 2; }, "2 pairs were given, expected 3 at least"},
        {[](Desc& d) { d.count = 0; }, "0 pairs were given"},
        {[](Desc& d) { d.count = UINT64_MAX; }, "desc.count is"},
        {[](Desc& d) { d.max_residual_mm = kNaN; }, "desc.max_residual_mm is nan"},
        {[&](Desc& d) { d.seen_xyz = bad.seen.data(); }, "pair 1 has a coordinate that is not"},
        {[&](Desc& d) { d.model_xyz = far.model.data(); },
         "pair 2: a coordinate of its model's place is 1e+150 mm from 0, expected 1e+06 at most"},
        {[&](Desc& d) { d.seen_xyz = far.seen.data(); },
         "pair 1: a coordinate of its seen place is 1100000 mm"},
        {[&](Desc& d) { d.seen_covariance = vague.covariance.data(); },
         "pair 1: a variance of its seen place is 1e+300 mm^2, expected 1e+12 at most"},
        {[&](Desc& d) { d.seen_covariance = bad.covariance.data(); }, "pair 0: the covariance"},
        {[&](Desc& d) { d.seen_covariance = half.data(); }, "the errors of 3 of 5 pairs"},
    };
    for (const auto& [change, said] : cases) {
        defrec_registration_pairs desc = pairs.desc();
        change(desc);
        defrec_registration made = nullptr;
        const std::string message = refusal(defrec_registration_from_pairs(&desc, &made), made);
        CHECK_MESSAGE(contains(message, said), message);
    }
    defrec_registration_pairs desc = pairs.desc();
    CHECK(defrec_registration_from_pairs(&desc, nullptr) == DEFREC_ERROR_ARGUMENT);
    defrec_registration made = nullptr;
    CHECK(defrec_registration_from_pairs(nullptr, &made) == DEFREC_ERROR_ARGUMENT);
}

TEST_CASE("row 192: targets that are not finite, and outputs that are missing") {
    const Pairs pairs = five_pairs();
    const defrec_registration_pairs desc = pairs.desc();
    TestRegistration registration;
    REQUIRE_OK(defrec_registration_from_pairs(&desc, registration.out()));
    const double model[9] = {1, 2, 3, 4, double{kNaN}, 6, 7, 8, 9}, far[3] = {0, 1e300, 0};
    double xyz[9], covariance[18], error[3];
    REQUIRE_OK(defrec_registration_move_points(registration.get(), far, 1, xyz, covariance, error));
    for (const double value : {xyz[0], xyz[1], covariance[0], error[0]}) CHECK(std::isnan(value));
    REQUIRE_OK(
        defrec_registration_move_points(registration.get(), model, 3, xyz, covariance, error));
    for (int axis = 0; axis < 3; ++axis) {
        CHECK(std::isfinite(xyz[axis]));
        CHECK(std::isnan(xyz[3 + axis]));
        CHECK(std::isfinite(xyz[6 + axis]));
    }
    CHECK(std::isnan(covariance[6]));
    CHECK(std::isnan(error[1]));
    CHECK(std::isfinite(error[2]));
    const defrec_registration r = registration.get();
    CHECK(defrec_registration_move_points(r, model, 3, xyz, nullptr, nullptr) == DEFREC_OK);
    CHECK(defrec_registration_move_points(r, nullptr, 0, nullptr, nullptr, nullptr) == DEFREC_OK);
    CHECK(defrec_registration_move_points(r, nullptr, 1, xyz, nullptr, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_registration_move_points(r, model, 1, nullptr, nullptr, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_registration_move_points(r, model, SIZE_MAX, xyz, nullptr, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_registration_get(r, nullptr) == DEFREC_ERROR_ARGUMENT);
}

TEST_CASE("row 16: a registration's handle: NULL, destroyed, foreign; any thread") {
    const Pairs pairs = five_pairs();
    const defrec_registration_pairs desc = pairs.desc();
    defrec_registration registration = nullptr;
    REQUIRE_OK(defrec_registration_from_pairs(&desc, &registration));
    const TestContext context;
    auto info = init<defrec_registration_info>();
    CHECK(defrec_registration_get(reinterpret_cast<defrec_registration>(context.get()), &info) ==
          DEFREC_ERROR_HANDLE);
    CHECK(contains(defrec_last_error(), "a context handle was given, a registration is expected"));
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([&] {
            auto mine = init<defrec_registration_info>();
            for (int k = 0; k < 100; ++k)
                if (defrec_registration_get(registration, &mine) != DEFREC_OK ||
                    mine.verdict != DEFREC_VERDICT_ACCEPTED)
                    std::abort();
        });
    for (std::thread& thread : threads) thread.join();
    defrec_registration_destroy(registration);
    defrec_registration_destroy(registration);
    CHECK(contains(defrec_last_error(), "destroyed already"));
    defrec_registration_destroy(nullptr);
    auto motion = init<defrec_free_motion>();
    auto other = init<defrec_registration_alternative>();
    double xyz[3] = {};
    CHECK(defrec_registration_get(registration, &info) == DEFREC_ERROR_HANDLE);
    CHECK(defrec_registration_get_free_motion(registration, 0, &motion) == DEFREC_ERROR_HANDLE);
    CHECK(defrec_registration_get_alternative(registration, 0, &other) == DEFREC_ERROR_HANDLE);
    CHECK(defrec_registration_move_points(registration, xyz, 1, xyz, nullptr, nullptr) ==
          DEFREC_ERROR_HANDLE);
}
