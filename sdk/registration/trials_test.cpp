// 200 registrations of an organ of which a camera sees a fifth, from starts that are up to 30 mm
// and 30 degrees off: errors at the organ's centre, what is expected of them, and how failures are
// told.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "sdk/registration/surface_registration.hpp"
#include "sdk/registration/test_organ.hpp"

using namespace defrec;

namespace {

constexpr double kTurn = 30 * std::numbers::pi / 180, kShiftMm = 30;

struct Trials {
    std::vector<double> errors, ratios;  // mm at the organ's centre, and over their expected errors
    double seen_share = 0;
    int wrong = 0;     // more than 3 mm off
    int failures = 0;  // not registered, or more than 3 mm off
    int untold = 0;    // of these, registered all the same
    double share_within(double ratio) const {
        return static_cast<double>(std::count_if(ratios.begin(), ratios.end(),
                                                 [=](double r) { return r <= ratio; })) /
               std::max(1.0, static_cast<double>(ratios.size()));
    }
    double quantile(double share) {
        if (errors.empty()) return 0;
        std::sort(errors.begin(), errors.end());
        return errors[static_cast<size_t>(share * static_cast<double>(errors.size() - 1))];
    }
};

// Bends the organ: the tissue is not what the model says.
TestMesh bent(const TestMesh& mesh, double amplitude_mm, std::mt19937& random) {
    TestMesh made;
    made.triangles = mesh.triangles;
    const Eigen::Vector3d one = 0.06 * random_direction(random),
                          other = 0.04 * random_direction(random);
    const Eigen::Vector3d along = random_direction(random);
    for (size_t i = 0; i < mesh.vertices.size() / 3; ++i) {
        const Eigen::Vector3d place = mesh.vertex(i);
        made.add(place + amplitude_mm *
                             (std::sin(one.dot(place)) + std::sin(other.dot(place) + 1)) * along);
    }
    return made;
}

// far: the start is turned by 60 to 180 degrees, farther than the search goes.
Trials run_trials(int count, double smooth_px, double bend_mm, bool is_far = false) {
    const TestMesh mesh = organ_mesh(5);
    const ModelSurface model(mesh.vertices, mesh.triangles, "organ");
    defrec_context_desc desc{};
    desc.threads = 2;
    const Services services(desc);
    Trials trials;
    for (int trial = 0; trial < count; ++trial) {
        std::mt19937 random(static_cast<uint32_t>(1000 + trial));
        std::uniform_real_distribution<double> uniform;
        const Pose truth = organ_pose(random, 95 + 30 * uniform(random), 0.35);
        TestViewSetting setting;
        setting.noise_mm = 0.1 + 0.4 * uniform(random);
        setting.smooth_px = smooth_px;
        const TestMesh tissue = bend_mm > 0 ? bent(mesh, bend_mm, random) : mesh;
        const TestView view = TestCamera(tissue, truth, setting).view(mesh, random);
        SurfaceOptions options;
        options.start = off_by(truth, model.centroid(), kTurn, kShiftMm, random);
        if (is_far) {
            Twist turn = Twist::Zero();
            turn.head<3>() = (1 + 2 * uniform(random)) * random_direction(random);
            options.start = moved(truth, turn, truth * model.centroid());
        }
        options.model_error_mm = bend_mm;  // 0: the model is exact
        const Registration found = register_surface(model, view.seen(), options, &services);
        const double error = (found.pose * model.centroid() - truth * model.centroid()).norm();
        const bool is_registered = found.verdict == RegistrationVerdict::kRegistered;
        trials.seen_share += view.seen_share / count;
        trials.failures += !is_registered || error > 3;
        trials.wrong += error > 3;
        trials.untold += is_registered && error > 3;
        if (!is_registered) continue;
        trials.errors.push_back(error);
        trials.ratios.push_back(error /
                                std::sqrt(found.placed(model.centroid()).covariance.trace()));
    }
    MESSAGE(count, " trials, noise smooth over ", smooth_px, " px, bent by ", bend_mm,
            std::string(is_far ? " mm, far starts" : " mm"), ", wrong ", trials.wrong, ": median ",
            trials.quantile(0.5), " p95 ", trials.quantile(0.95), " max ", trials.quantile(1),
            " mm, within 1, 2, 3: ", trials.share_within(1), " ", trials.share_within(2), " ",
            trials.share_within(3), ", failures ", trials.failures, ", untold ", trials.untold,
            ", seen ", trials.seen_share);
    return trials;
}

void check(Trials trials, int count) {
    CHECK(trials.quantile(0.5) <= 0.5);
    CHECK(trials.quantile(0.95) <= 1.0);
    CHECK(trials.failures <= count / 100);
    CHECK(trials.untold == 0);
    CHECK(trials.share_within(2) >= 0.93);
    CHECK(trials.share_within(3) >= 0.985);
}

}  // namespace

TEST_CASE("a fifth of an organ, with noise, holes and an instrument, is registered") {
    const Trials trials = run_trials(200, 0, 0);
    CHECK(trials.seen_share > 0.15);
    CHECK(trials.seen_share < 0.25);
    check(trials, 200);
}

TEST_CASE("the same with noise that neighbours share") { check(run_trials(100, 2, 0), 100); }

TEST_CASE(
    "an organ that is bent by half a millimetre, and said to be, is told as exactly as it is") {
    Trials trials = run_trials(60, 2, 0.5);
    CHECK(trials.quantile(0.5) <= 1);
    CHECK(trials.untold == 0);
    CHECK(trials.share_within(2) >= 0.93);
    CHECK(trials.share_within(3) >= 0.985);
}

TEST_CASE("starts that are too far away: the search that went wrong is told") {
    const Trials trials = run_trials(50, 0, 0, true);
    CHECK(trials.wrong > 20);
    CHECK(trials.untold <= trials.wrong / 100);
}
