// Hand-eye calibrations of 200 sets of still poses and of 100 motions with noise: how far they are
// off, and whether the covariance says so.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "sdk/hand_eye/test_motion.hpp"

using namespace defrec;

namespace {

struct Trials {
    std::vector<double> mm, degrees, offset_s;
    std::vector<double> ratios, offset_ratios;  // errors, in standard deviations
    int refused = 0;
};

double quantile(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

double share_within(const std::vector<double>& values, double most) {
    return static_cast<double>(std::count_if(values.begin(), values.end(),
                                             [=](double value) { return value <= most; })) /
           static_cast<double>(values.size());
}

void add(Trials& trials, const HandEyeCalibration& found, const TestSetup& setup) {
    if (found.verdict != HandEyeVerdict::kSolved) {
        ++trials.refused;
        return;
    }
    const Eigen::Isometry3d &made = found.transforms.marker_from_camera,
                            &truth = setup.truth.marker_from_camera;
    const Eigen::Isometry3d motion = truth * made.inverse();
    HandEyeResidual error;
    error << turn_of(motion.linear()), motion.translation();
    trials.degrees.push_back(error.head<3>().norm() / kTestDegree);
    trials.mm.push_back((truth.translation() - made.translation()).norm());
    for (int i = 0; i < 6; ++i)
        trials.ratios.push_back(std::abs(error[i]) / std::sqrt(found.covariance(i, i)));
}

TestSetup random_setup(TestRandom& random) {
    TestSetup setup;
    setup.truth.marker_from_camera.linear() =
        rotation_of(random.uniform(0, 3) * random.direction());
    return setup;
}

Trials still_trials(TestNoise noise, double degrees, bool is_stated) {
    Trials trials;
    for (unsigned i = 0; i < 200; ++i) {
        TestRandom random(1000 + i);
        const TestSetup setup = random_setup(random);
        const TestPoses poses = still_poses(setup, 12, degrees, noise, random);
        HandEyeOptions options;
        options.is_paired = true;
        if (is_stated) options.noise = noise.stated();
        add(trials, calibrate_hand_eye(poses.camera, poses.tracker, options), setup);
    }
    return trials;
}

void report(const std::string& name, const Trials& trials) {
    MESSAGE(name, ": median ", quantile(trials.mm, 0.5), " mm, ", quantile(trials.degrees, 0.5),
            " degrees, 95 % ", quantile(trials.mm, 0.95), " mm, ", quantile(trials.degrees, 0.95),
            " degrees; within 2 and 3 standard deviations ", share_within(trials.ratios, 2), " ",
            share_within(trials.ratios, 3), "; refused ", trials.refused);
}

}  // namespace

TEST_CASE("12 still poses with 0.2 mm and 0.1 degree of noise between both streams") {
    const double half = std::sqrt(0.5);
    const Trials trials = still_trials({0.2 * half, 0.1 * half}, 60, true);
    report("of both together", trials);
    CHECK(trials.refused == 0);
    CHECK(quantile(trials.mm, 0.5) < 0.3);
    CHECK(quantile(trials.degrees, 0.5) < 0.1);
    CHECK(share_within(trials.ratios, 2) > 0.93);
    CHECK(share_within(trials.ratios, 3) > 0.985);
}

TEST_CASE("12 still poses with as much noise in each stream") {
    const Trials wide = still_trials({0.2, 0.1}, 90, true);
    report("of each, turned by up to 90 degrees", wide);
    CHECK(quantile(wide.mm, 0.5) < 0.35);
    CHECK(quantile(wide.degrees, 0.5) < 0.1);
    const Trials trials = still_trials({0.2, 0.1}, 60, true);
    report("of each, turned by up to 60 degrees", trials);
    CHECK(quantile(trials.mm, 0.95) < 1);
    CHECK(share_within(trials.ratios, 2) > 0.93);
    CHECK(share_within(trials.ratios, 3) > 0.985);
    const Trials unstated = still_trials({0.2, 0.1}, 60, false);
    report("of each, unstated", unstated);
    CHECK(unstated.refused < 10);
    CHECK(share_within(unstated.ratios, 2) > 0.93);
    CHECK(share_within(unstated.ratios, 3) > 0.985);
}

TEST_CASE("motions of 20 s with an offset of up to half a second") {
    Trials trials;
    for (unsigned i = 0; i < 100; ++i) {
        TestRandom random(2000 + i);
        const TestSetup setup = random_setup(random);
        const double offset = random.uniform(-0.5, 0.5);
        const TestPoses poses = moving_poses(setup, 20, offset, {0.2, 0.1}, random);
        const HandEyeCalibration found = calibrate_hand_eye(poses.camera, poses.tracker, {});
        add(trials, found, setup);
        trials.offset_s.push_back(std::abs(found.offset.offset_s - offset));
        trials.offset_ratios.push_back(trials.offset_s.back() / found.offset.sigma_s);
    }
    report("motions", trials);
    MESSAGE("offset: median ", 1000 * quantile(trials.offset_s, 0.5), " ms, 95 % ",
            1000 * quantile(trials.offset_s, 0.95), " ms; within 2 and 3 standard deviations ",
            share_within(trials.offset_ratios, 2), " ", share_within(trials.offset_ratios, 3));
    CHECK(trials.refused == 0);
    CHECK(quantile(trials.offset_s, 1) < 0.005);
    CHECK(quantile(trials.mm, 0.95) < 0.3);
    CHECK(share_within(trials.offset_ratios, 2) > 0.93);
    CHECK(share_within(trials.ratios, 2) > 0.93);
    CHECK(share_within(trials.ratios, 3) > 0.985);
}

TEST_CASE("the camera's pose by its marker is as far off as its covariance says") {
    const TestNoise noise{0.2, 0.1};
    constexpr unsigned kTrials = 200;
    double squared = 0;
    int solved = 0;
    for (unsigned i = 0; i < kTrials; ++i) {
        TestRandom random(5000 + i);
        const TestSetup setup = random_setup(random);
        const TestPoses poses = still_poses(setup, 12, 60, noise, random);
        HandEyeOptions options;
        options.is_paired = true;
        options.noise = noise.stated();
        const HandEyeCalibration found = calibrate_hand_eye(poses.camera, poses.tracker, options);
        if (found.verdict != HandEyeVerdict::kSolved) continue;
        ++solved;
        const Eigen::Isometry3d marker =
            setup.tracker(test_pose(random.direction(), 100 * random.direction()));
        const Eigen::Isometry3d seen = noisy(marker, noise, random);
        const Eigen::Isometry3d truth = marker * setup.truth.marker_from_camera,
                                made = seen * found.transforms.marker_from_camera;
        HandEyeResidual error;
        error << turn_of(truth.linear() * made.linear().transpose()),
            truth.translation() - made.translation();
        squared += error.dot(found.pose_covariance(seen).ldlt().solve(error));
    }
    CHECK(solved > 190);
    // Six numbers each.
    CHECK(squared / (6 * solved) == doctest::Approx(1).epsilon(0.2));
}
