// Registration of an organ that has changed its shape, and of one that has not: what is deformed,
// what is refused, and what is said of targets. How exact it is: trials_test.cpp.
#include "sdk/registration/elastic/elastic_registration.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

#include "sdk/registration/elastic/elastic_fit.hpp"
#include "sdk/registration/elastic/test_deformations.hpp"

using namespace defrec;

namespace {

constexpr double kDeformationMm = 10;

// An organ, deformed or not, and what a camera sees of it.
struct Scene {
    TestMesh mesh;
    ModelSurface model{mesh.vertices, mesh.triangles, "the model"};
    Displaced by;
    Pose truth;
    TestView view;
    SurfaceOptions options;

    Scene(TestDeformation kind, double amplitude_mm, int divisions = 4)
        : mesh(organ_mesh(divisions)) {
        std::mt19937 random(21);
        by = deformation_of(kind, mesh, amplitude_mm, random);
        truth = organ_pose(random, 140, 0.2);
        view = TestCamera(displaced(mesh, by), truth, {}).view(mesh, random);
        options.start = off_by(truth, model.centroid(), 0.2, 10, random);
        options.starts = 6;
    }
    Registration run(const Services* helpers = nullptr) const {
        return register_elastic(model, view.seen(), options, kDeformationMm, helpers);
    }
    double error(const Registration& found, const Eigen::Vector3d& place) const {
        return (found.placed(place).place - truth * by(place)).norm();
    }
};

double expected(const Registration& found, const Eigen::Vector3d& place) {
    return std::sqrt(found.placed(place).covariance.trace());
}

}  // namespace

TEST_CASE("an organ that is twisted is deformed, and targets are nearer to where they are") {
    const Scene scene(TestDeformation::kTwisted, 12);
    const Registration rigid =
        register_surface(scene.model, scene.view.seen(), scene.options, nullptr);
    const Registration found = scene.run();
    INFO(found.reason, " ", found.deformation.reason);
    REQUIRE(found.deformation.verdict == DeformationVerdict::kApplied);
    CHECK(found.verdict == RegistrationVerdict::kRegistered);
    double squared = 0, squared_rigid = 0, squared_ratio = 0;
    const std::vector<Eigen::Vector3d> targets{{60, 0, -20},   {-60, 10, -20}, {30, -30, -10},
                                               {-30, 25, -15}, {0, 0, -25},    {80, 0, 0}};
    for (const Eigen::Vector3d& target : targets) {
        const double error = scene.error(found, target);
        squared += error * error;
        squared_rigid += std::pow(scene.error(rigid, target), 2);
        squared_ratio += std::pow(error / expected(found, target), 2);
    }
    CHECK(squared < 0.25 * squared_rigid);
    CHECK(squared_ratio < 4 * static_cast<double>(targets.size()));
    // The residuals say so, and what was not seen is less exact.
    CHECK(found.residuals.robust_mm < found.deformation.rigid_robust_mm);
    CHECK(found.deformation.rigid_robust_mm == doctest::Approx(rigid.residuals.robust_mm));
    CHECK(found.deformation.max_mm > 2);
    CHECK(found.deformation.rms_mm < found.deformation.max_mm);
    CHECK(found.deformation.largest_strain < 0.5);
    CHECK(expected(found, {0, 0, 40}) > expected(found, {0, 0, -40}));
    CHECK(expected(found, {0, 0, -200}) > expected(found, {0, 0, -60}));

    defrec_context_desc desc{};
    desc.threads = 3;
    const Services services(desc);
    const Registration again = scene.run(&services);
    CHECK(again.pose.translation == found.pose.translation);
    CHECK(again.covariance == found.covariance);
    CHECK(again.placed({5, 6, 7}).covariance == found.placed({5, 6, 7}).covariance);
}

TEST_CASE("row 194: an organ that has not changed its shape is registered as a rigid one") {
    const Scene scene(TestDeformation::kNone, 0);
    const Registration rigid =
        register_surface(scene.model, scene.view.seen(), scene.options, nullptr);
    const Registration found = scene.run();
    CHECK(found.deformation.verdict == DeformationVerdict::kRefused);
    CHECK_MESSAGE(found.deformation.reason.starts_with("the rigid motion explains the surface"),
                  found.deformation.reason);
    CHECK(found.verdict == RegistrationVerdict::kRegistered);
    CHECK(found.pose.translation == rigid.pose.translation);
    const Eigen::Vector3d far(0, 0, 45);
    CHECK((found.placed(far).place - rigid.placed(far).place).norm() < 1e-9);
    // A deformation may hide where nothing was seen.
    CHECK(expected(found, far) > expected(rigid, far));
    CHECK(found.deformation.max_mm == 0);
}

TEST_CASE("row 194: seen from inside the model there is nothing to deform it to") {
    const TestMesh cube = sphere_mesh(3, [](const Eigen::Vector3d& d) {
        return Eigen::Vector3d(100 * d / d.cwiseAbs().maxCoeff());
    });
    const ModelSurface model(cube.vertices, cube.triangles, "the model");
    std::vector<float> places;
    for (int y = -20; y <= 20; y += 4)
        for (int x = -20; x <= 20; x += 4)
            for (const int axis : {x, y, 80}) places.push_back(static_cast<float>(axis));
    SurfaceOptions options;
    options.viewer = Eigen::Vector3d::Zero();
    const Registration found =
        register_elastic(model, {places, {}, {}}, options, kDeformationMm, nullptr);
    CHECK(found.verdict == RegistrationVerdict::kFailed);
    CHECK(found.deformation.verdict == DeformationVerdict::kRefused);
    CHECK_MESSAGE(found.deformation.reason.starts_with("no point was matched to the model"),
                  found.deformation.reason);
    CHECK(found.deformation.shape == nullptr);
    CHECK(found.placed({1, 2, 3}).place.allFinite());

    // As an alternative of another pose may lie.
    const SurfaceProblem problem(model, {places, {}, {}}, options);
    const ForceModes modes(model, nullptr);
    ElasticFit fit(problem, modes, kDeformationMm, options.start);
    fit.run();
    CHECK(fit.pose().translation == options.start.translation);
    CHECK(fit.matches().quality().cost == 1);
    CHECK(fit.seen_at_rest().empty());
}

TEST_CASE("row 194: a surface of something else, or a ball, gives no deformation") {
    Scene other(TestDeformation::kNone, 0, 3);
    other.options.starts = 2;
    for (size_t i = 0; i < other.view.places.size(); i += 3)
        other.view.places[i + 2] += 8 * std::sin(0.25F * other.view.places[i]);
    const Registration lost = other.run();
    CHECK(lost.deformation.verdict == DeformationVerdict::kRefused);
    CHECK(lost.verdict != RegistrationVerdict::kRegistered);

    const TestMesh ball =
        sphere_mesh(3, [](const Eigen::Vector3d& d) { return Eigen::Vector3d(60 * d); });
    const ModelSurface model(ball.vertices, ball.triangles, "the model");
    const Pose pose{Eigen::Matrix3d::Identity(), {0, 0, 150}};
    std::mt19937 random(2);
    const TestView view = TestCamera(ball, pose, {}).view(ball, random);
    SurfaceOptions options;
    options.start = pose;
    options.starts = 2;
    const Registration turning =
        register_elastic(model, view.seen(), options, kDeformationMm, nullptr);
    CHECK(turning.deformation.verdict == DeformationVerdict::kRefused);
    CHECK(turning.verdict == RegistrationVerdict::kUndetermined);
    CHECK(expected(turning, {60, 0, 0}) > 100);
}
