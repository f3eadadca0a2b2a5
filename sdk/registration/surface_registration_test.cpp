// Registration of a surface: what is said of shapes that leave motions open or fit in several ways,
// of surfaces that fit nowhere, and what is refused.
#include "sdk/registration/surface_registration.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <numbers>
#include <random>
#include <string>

#include "sdk/base/util/error.hpp"
#include "sdk/registration/starts.hpp"
#include "sdk/registration/test_organ.hpp"
#include "sdk/testing/check_says.hpp"

using namespace defrec;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

struct Case {
    TestMesh mesh;
    Pose truth;
    TestView view;
    SurfaceOptions options;

    Case(const TestMesh& its_mesh, const Pose& pose, double turn = 12 * kDegree, double shift = 10)
        : mesh(its_mesh), truth(pose) {
        std::mt19937 random(5);
        view = TestCamera(mesh, truth, {}).view(mesh, random);
        options.start = off_by(truth, {0, 0, 0}, turn, shift, random);
    }
    Registration run(const Services* helpers = nullptr) const {
        const ModelSurface model(mesh.vertices, mesh.triangles, "model");
        return register_surface(model, view.seen(), options, helpers);
    }
};

TestMesh stretched(const Eigen::Vector3d& axes, int divisions = 4) {
    return sphere_mesh(
        divisions, [=](const Eigen::Vector3d& d) { return Eigen::Vector3d(axes.cwiseProduct(d)); });
}

TestMesh box(const Eigen::Vector3d& half) {
    return sphere_mesh(4, [=](const Eigen::Vector3d& d) {
        return Eigen::Vector3d(half.cwiseProduct(d / d.cwiseAbs().maxCoeff()));
    });
}

TestMesh cylinder(double radius, double half) {
    return sphere_mesh(4, [=](const Eigen::Vector3d& d) {
        const double size = std::max(std::hypot(d.x(), d.z()), std::abs(d.y()));
        return Eigen::Vector3d(radius * d.x() / size, half * d.y() / size, radius * d.z() / size);
    });
}

int turns_of(const Registration& found) {
    int turns = 0;
    for (const FreeMotion& motion : found.free) turns += motion.is_turn;
    return turns;
}

const Case& organ() {
    static const Case made = [] {
        std::mt19937 random(7);
        return Case(organ_mesh(4), organ_pose(random, 110, 0.3), 25 * kDegree, 20);
    }();
    return made;
}

}  // namespace

TEST_CASE("an organ is registered, and its result does not depend on threads") {
    const Registration found = organ().run();
    CHECK(found.verdict == RegistrationVerdict::kRegistered);
    CHECK(
        (found.pose * Eigen::Vector3d(0, 0, 0) - organ().truth * Eigen::Vector3d(0, 0, 0)).norm() <
        0.5);
    CHECK(found.free.empty());
    CHECK(found.alternatives.empty());
    CHECK(found.residual_mm.size() == organ().view.places.size() / 3);
    // The instrument's points are outliers, nearly all, and few others are.
    size_t instrument = 0, told = 0, wrongly_told = 0;
    for (size_t i = 0; i < found.is_inlier.size(); ++i) {
        const bool is_instrument = organ().view.is_instrument[i] != 0;
        instrument += is_instrument;
        told += is_instrument && found.is_inlier[i] == 0;
        wrongly_told += !is_instrument && found.is_inlier[i] == 0;
    }
    REQUIRE(instrument > 50);
    CHECK(told >= 0.9 * static_cast<double>(instrument));
    CHECK(wrongly_told <= found.is_inlier.size() / 50);

    defrec_context_desc desc{};
    desc.threads = 3;
    const Services services(desc);
    const Registration again = organ().run(&services);
    CHECK(again.pose.rotation == found.pose.rotation);
    CHECK(again.pose.translation == found.pose.translation);
    CHECK(again.covariance == found.covariance);
}

TEST_CASE("the covariance is that of a turn and a shift about the frame's origin") {
    const Registration found = organ().run();
    CHECK(found.covariance.isApprox(found.covariance.transpose(), 1e-9));
    // A place in the origin has the covariance of the shift; one beside it that of the turn as
    // well.
    const Eigen::Vector3d origin = found.pose.inverse() * Eigen::Vector3d(0, 0, 0);
    const Eigen::Matrix3d shift = found.covariance.bottomRightCorner<3, 3>();
    CHECK(found.placed(origin).covariance.isApprox(shift, 1e-9));
    // Seen tissue is more exact than what lies far beside it.
    CHECK(found.placed({0, 0, -50}).covariance.trace() <
          found.placed({0, 0, 300}).covariance.trace());
}

TEST_CASE("row 174: a ball leaves all turns about its centre open") {
    const Registration found =
        Case(stretched({60, 60, 60}), {Eigen::Matrix3d::Identity(), {0, 0, 150}}).run();
    CHECK(found.verdict == RegistrationVerdict::kUndetermined);
    REQUIRE(found.free.size() == 3);
    CHECK(turns_of(found) == 3);
    for (const FreeMotion& motion : found.free) {
        const Eigen::Vector3d from_centre = motion.point - Eigen::Vector3d(0, 0, 150);
        CHECK((from_centre - motion.axis * motion.axis.dot(from_centre)).norm() < 2.5);
    }
}

TEST_CASE("row 174: a plane leaves both shifts along it and the turn in it open") {
    const Registration found =
        Case(box({120, 90, 40}), {Eigen::Matrix3d::Identity(), {0, 0, 130}}).run();
    CHECK(found.verdict == RegistrationVerdict::kUndetermined);
    REQUIRE(found.free.size() == 3);
    CHECK(turns_of(found) == 1);
    for (const FreeMotion& motion : found.free) {
        CAPTURE(motion.text());
        CHECK(std::abs(motion.axis.z()) == doctest::Approx(motion.is_turn ? 1 : 0).epsilon(0.01));
    }
    // The distance is known all the same.
    CHECK((found.pose * Eigen::Vector3d(0, 0, -40)).z() == doctest::Approx(90).epsilon(0.002));
}

TEST_CASE("row 174: a cylinder leaves the shift along its axis and the turn about it open") {
    const Registration found =
        Case(cylinder(50, 150), {Eigen::Matrix3d::Identity(), {0, 0, 130}}).run();
    CHECK(found.verdict == RegistrationVerdict::kUndetermined);
    REQUIRE(found.free.size() == 2);
    CHECK(turns_of(found) == 1);
    for (const FreeMotion& motion : found.free) CHECK(std::abs(motion.axis.y()) > 0.99);
    CHECK_SAYS(found.reason, "shift along (0 1 0)");
}

TEST_CASE("row 175: a shape that fits in several ways is ambiguous where the start allows them") {
    // With facets so fine that they hold nothing: three axes, half a turn about each fits as well.
    Case ellipsoid(stretched({95, 62, 48}, 5), {rotation_of({0.2, 0.3, 0.5}), {0, 0, 150}});
    ellipsoid.options.starts = 150;
    ellipsoid.options.start_turn = 3.14;
    ellipsoid.options.model_error_mm = 0;
    const Registration found = ellipsoid.run();
    CHECK(found.verdict == RegistrationVerdict::kAmbiguous);
    REQUIRE_FALSE(found.alternatives.empty());
    CHECK(found.alternatives[0].distance_mm > 20);
    CHECK(found.alternatives[0].rms_mm < 1.2 * found.residuals.rms_mm);
    CHECK_SAYS(found.reason, "fits as well");
}

TEST_CASE("row 176: a surface that is not the model's, and a start too far away, are failures") {
    Case other(stretched({80, 25, 25}), {Eigen::Matrix3d::Identity(), {0, 0, 120}});
    const ModelSurface model(organ().mesh.vertices, organ().mesh.triangles, "organ");
    const Registration found = register_surface(model, other.view.seen(), other.options, nullptr);
    CHECK(found.verdict != RegistrationVerdict::kRegistered);

    SurfaceOptions far = organ().options;
    far.start = moved(organ().truth, (Twist() << 1.8, 0, 0, 0, 0, 0).finished(),
                      organ().truth * Eigen::Vector3d(0, 0, 0));
    far.start_turn = 0.1;
    const Registration lost = register_surface(model, organ().view.seen(), far, nullptr);
    CHECK(lost.verdict != RegistrationVerdict::kRegistered);

    // An organ that has bent by more than is stated.
    Case bent = organ();
    for (size_t i = 0; i < bent.view.places.size(); i += 3)
        bent.view.places[i + 2] += 3 * std::sin(0.15f * bent.view.places[i]);
    const Registration poor = bent.run();
    CHECK(poor.verdict == RegistrationVerdict::kFailed);
    CHECK_SAYS(poor.reason, "times what the errors that are stated explain");
}

TEST_CASE("row 170: surfaces and starts that are refused, each with the reason") {
    const ModelSurface model(organ().mesh.vertices, organ().mesh.triangles, "organ");
    const auto refusal = [&](const SeenSurface& seen,
                             const SurfaceOptions& options) -> std::string {
        try {
            register_surface(model, seen, options, nullptr);
        } catch (const Error& error) {
            CHECK(error.status() == DEFREC_ERROR_ARGUMENT);
            return error.what();
        }
        return "accepted";
    };
    std::vector<float> places(300, 1), covariances(600, 0);
    CHECK_SAYS(refusal({{places.data(), 30}, {}, {}}, {}), "10 points of the surface were given");
    CHECK_SAYS(refusal({places, {places.data(), 30}, {}}, {}), "10 normals");
    CHECK_SAYS(refusal({places, {}, covariances}, {}), "point 0: its covariance is none");
    places[7] = std::numeric_limits<float>::quiet_NaN();
    CHECK_SAYS(refusal({places, {}, {}}, {}), "point 2 has a coordinate that is not finite");
    places[7] = 1;
    SurfaceOptions options;
    options.start.rotation(0, 0) = 2;
    CHECK_SAYS(refusal({places, {}, {}}, options), "the start is no rigid motion");
}

TEST_CASE("points at one place say nothing, and are no crash") {
    const std::vector<float> places(300, 1);
    const ModelSurface model(organ().mesh.vertices, organ().mesh.triangles, "organ");
    const Registration found = register_surface(model, {places, {}, {}}, {}, nullptr);
    CHECK(found.verdict != RegistrationVerdict::kRegistered);
    CHECK(found.covariance.allFinite());
}

TEST_CASE("starts: the given one first, the others within what is asked for, spread over it") {
    const Eigen::Vector3d centre(1, 2, 100);
    const std::vector<Pose> starts = spread_starts(organ().truth, centre, 0.5, 30, 200);
    REQUIRE(starts.size() == 200);
    CHECK(starts[0].translation == organ().truth.translation);
    double most_turn = 0, most_shift = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Pose& start : starts) {
        const double turn =
            Eigen::AngleAxisd(start.rotation * organ().truth.rotation.transpose()).angle();
        const Eigen::Vector3d shift = start * (organ().truth.inverse() * centre) - centre;
        most_turn = std::max(most_turn, turn);
        most_shift = std::max(most_shift, shift.norm());
        mean += shift / 200;
    }
    CHECK(most_turn < 0.5001);
    CHECK(most_turn > 0.45);
    CHECK(most_shift < 30.001);
    CHECK(most_shift > 27);
    CHECK(mean.norm() < 2);
}
