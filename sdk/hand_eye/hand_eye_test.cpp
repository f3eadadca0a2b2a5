// Hand-eye calibrations of motions with known truth, and sets of poses that are refused.
#include "sdk/hand_eye/hand_eye.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <string>

#include "sdk/base/util/error.hpp"
#include "sdk/hand_eye/speed_correlation.hpp"
#include "sdk/hand_eye/test_motion.hpp"
#include "sdk/hand_eye/time_offset.hpp"
#include "sdk/testing/check_says.hpp"

using namespace defrec;

namespace {

HandEyeOptions paired() {
    HandEyeOptions options;
    options.is_paired = true;
    return options;
}

// How far the camera is off, in mm and degrees.
double off_mm(const HandEyeCalibration& calibration, const TestSetup& setup) {
    return (calibration.transforms.marker_from_camera.translation() -
            setup.truth.marker_from_camera.translation())
        .norm();
}
double off_degrees(const HandEyeCalibration& calibration, const TestSetup& setup) {
    return turn_of(calibration.transforms.marker_from_camera.linear().transpose() *
                   setup.truth.marker_from_camera.linear())
               .norm() /
           kTestDegree;
}

HandEyeCalibration calibrate(const TestPoses& poses, const HandEyeOptions& options) {
    return calibrate_hand_eye(poses.camera, poses.tracker, options);
}

std::string refusal(const TestPoses& poses, const HandEyeOptions& options) {
    try {
        calibrate(poses, options);
    } catch (const Error& error) {
        CHECK(error.status() == DEFREC_ERROR_ARGUMENT);
        return error.what();
    }
    return "accepted";
}

// Poses of which only the rotation is given; the places follow none.
TestPoses turned(const TestSetup& setup, const std::vector<Eigen::Vector3d>& turns, TestNoise noise,
                 TestRandom& random) {
    TestPoses poses;
    for (const Eigen::Vector3d& turn : turns) {
        const Eigen::Isometry3d camera =
            test_pose(turn, Eigen::Vector3d(random.uniform(-60, 60), random.uniform(-60, 60), -90));
        poses.add(static_cast<double>(poses.camera.size()), noisy(camera, noise, random),
                  noisy(setup.tracker(camera), noise, random));
    }
    return poses;
}

// Poses that follow from a function of time, for 20 s; the tracker's clock is 0.1 s ahead.
template <class Motion>
TestPoses moved(const Motion& motion, TestNoise noise, TestRandom& random) {
    const TestSetup setup;
    TestPoses poses;
    constexpr double kInterval = 0.04, kLength = 20, kOffset = 0.1;
    for (double time = 0; time < kLength; time += kInterval)
        poses.add(time, noisy(motion(time), noise, random),
                  noisy(setup.tracker(motion(time - kOffset)), noise, random));
    return poses;
}

}  // namespace

TEST_CASE("exact poses give the exact transforms, and a turn of any size") {
    TestRandom random(1);
    TestSetup setup;
    for (int i = 0; i < 20; ++i) {
        setup.truth.marker_from_camera =
            test_pose(random.uniform(0, 3.1) * random.direction(), random.normal(200));
        const HandEyeCalibration found =
            calibrate(still_poses(setup, i < 10 ? 3 : 12, 170, {}, random), paired());
        CHECK(found.verdict == HandEyeVerdict::kSolved);
        CHECK(off_mm(found, setup) < 1e-4);
        CHECK(off_degrees(found, setup) < 1e-5);
        CHECK(found.transforms.tracker_from_world.isApprox(setup.truth.tracker_from_world, 1e-6));
        CHECK(found.quality.length_factor == doctest::Approx(1).epsilon(1e-5));
    }
}

TEST_CASE("a third of the poses may be wrong, and is told") {
    TestRandom random(2);
    const TestSetup setup;
    TestPoses poses = still_poses(setup, 30, 60, {0.2, 0.1}, random);
    for (std::size_t i = 0; i < 30; i += 3)
        poses.camera[i].pose = test_pose(random.direction(), random.normal(60));
    const HandEyeCalibration found = calibrate(poses, paired());
    CHECK(found.verdict == HandEyeVerdict::kSolved);
    CHECK(off_mm(found, setup) < 1);
    CHECK(found.quality.inliers == 20);
    CHECK(found.is_inlier[0] == 0);
    CHECK(found.is_inlier[1] == 1);
    CHECK(found.residual_mm[0] > 10);
}

TEST_CASE("residuals beyond the stated errors enlarge the covariance, with a note") {
    TestRandom random(3);
    const TestSetup setup;
    const TestPoses poses = still_poses(setup, 30, 60, {0.6, 0.3}, random);
    HandEyeOptions options = paired();
    options.max_error_mm = 5;
    options.noise = TestNoise{0.6, 0.3}.stated();
    const HandEyeCalibration right = calibrate(poses, options);
    options.noise = TestNoise{0.2, 0.1}.stated();
    const HandEyeCalibration small = calibrate(poses, options);
    CHECK(right.notes.empty());
    CHECK(small.quality.error_ratio == doctest::Approx(3).epsilon(0.15));
    REQUIRE(small.notes.size() == 1);
    CHECK_SAYS(small.notes[0], "times what the stated errors explain");
    CHECK(small.covariance.trace() == doctest::Approx(right.covariance.trace()).epsilon(0.3));
}

TEST_CASE("row 180: shifts alone, or too little rotation, determine nothing") {
    TestRandom random(4);
    const TestSetup setup;
    const std::vector<Eigen::Vector3d> none(20, Eigen::Vector3d::Zero());
    const HandEyeCalibration shifted = calibrate(turned(setup, none, {0.2, 0.1}, random), paired());
    CHECK(shifted.verdict == HandEyeVerdict::kUndetermined);
    CHECK_SAYS(shifted.reason, "the camera was turned by 0.");
    CHECK(shifted.open.size() == 3);
    CHECK(std::isnan(shifted.covariance(0, 0)));

    const HandEyeCalibration little =
        calibrate(still_poses(setup, 6, 14, {0.2, 0.1}, random), paired());
    CHECK(little.verdict == HandEyeVerdict::kUndetermined);
    CHECK_SAYS(little.reason, "does not determine the transform to within 1 mm");
    CHECK_FALSE(little.open.empty());
    CHECK(little.covariance.diagonal().maxCoeff() > 1e5);
}

TEST_CASE("row 181: rotations about one axis leave the shift along it open") {
    TestRandom random(5);
    const TestSetup setup;
    const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -1).normalized();
    std::vector<Eigen::Vector3d> turns;
    for (int i = 0; i < 20; ++i) turns.emplace_back(random.uniform(-1, 1) * axis);
    const HandEyeCalibration found = calibrate(turned(setup, turns, {0.2, 0.1}, random), paired());
    CHECK(found.verdict == HandEyeVerdict::kUndetermined);
    CHECK_SAYS(found.reason, "all rotations are about one axis");
    REQUIRE(found.open.size() == 1);
    CHECK_FALSE(found.open[0].is_turn);
    const Eigen::Vector3d in_marker = setup.truth.marker_from_camera.linear() * axis;
    CHECK(std::abs(found.open[0].axis.dot(in_marker)) > 0.99);
}

TEST_CASE("row 182: fewer than three poses") {
    TestRandom random(6);
    const TestPoses poses = still_poses({}, 2, 60, {}, random);
    const HandEyeCalibration found = calibrate(poses, paired());
    CHECK(found.verdict == HandEyeVerdict::kUndetermined);
    CHECK_SAYS(found.reason, "there are 2 poses of both at one time, expected 3 at least");
}

TEST_CASE("row 183: one stream inverted is told, of either") {
    TestRandom random(7);
    const TestSetup setup;
    for (const bool is_camera : {true, false}) {
        TestPoses poses = still_poses(setup, 12, 60, {0.2, 0.1}, random);
        for (TimedPose& pose : is_camera ? poses.camera : poses.tracker)
            pose.pose = pose.pose.inverse();
        const HandEyeCalibration found = calibrate(poses, paired());
        CHECK(found.verdict == HandEyeVerdict::kFailed);
        CHECK_SAYS(found.reason, "one of both streams is inverted");
    }
}

TEST_CASE("row 184: lengths in another unit are told, and a small difference is noted") {
    TestRandom random(8);
    const TestSetup setup;
    TestPoses poses = still_poses(setup, 30, 60, {0.1, 0.05}, random);
    TestPoses metres = poses, short_ones = poses;
    for (TimedPose& pose : metres.camera) pose.pose.translation() /= 1000;
    for (TimedPose& pose : short_ones.camera) pose.pose.translation() /= 1.02;
    const HandEyeCalibration found = calibrate(metres, paired());
    CHECK(found.verdict == HandEyeVerdict::kFailed);
    CHECK_SAYS(found.reason, "check both units");
    HandEyeOptions options = paired();
    options.noise = TestNoise{0.5, 0.25}.stated();
    const HandEyeCalibration scaled = calibrate(short_ones, options);
    CHECK(scaled.verdict == HandEyeVerdict::kSolved);
    CHECK(scaled.quality.length_factor == doctest::Approx(1.02).epsilon(0.005));
    REQUIRE_FALSE(scaled.notes.empty());
    CHECK_SAYS(scaled.notes.back(), "shorter than the tracker's by");
}

TEST_CASE("row 185: poses that do not belong together") {
    TestRandom random(9);
    const TestSetup setup;
    TestPoses poses = still_poses(setup, 12, 60, {0.2, 0.1}, random);
    poses.tracker = still_poses(setup, 12, 60, {0.2, 0.1}, random).tracker;
    const HandEyeCalibration found = calibrate(poses, paired());
    CHECK(found.verdict == HandEyeVerdict::kFailed);
    CHECK_SAYS(found.reason, "no transform fits");
}

TEST_CASE("row 186: poses and times that are none are refused") {
    TestRandom random(10);
    const TestSetup setup;
    const TestPoses poses = still_poses(setup, 5, 60, {}, random);
    TestPoses bad = poses;
    bad.camera[2].pose.translation().x() = std::numeric_limits<double>::quiet_NaN();
    CHECK_SAYS(refusal(bad, paired()), "camera's poses: pose 2 is not finite");
    bad = poses;
    bad.tracker[3].pose.linear() *= 1.01;
    CHECK_SAYS(refusal(bad, paired()), "tracker's poses: pose 3 is no rotation and translation");
    bad.tracker[3].pose.linear() = -Eigen::Matrix3d::Identity();
    CHECK_SAYS(refusal(bad, paired()), "or mirrors");
    bad = poses;
    bad.tracker.pop_back();
    CHECK_SAYS(refusal(bad, paired()), "5 poses of the camera and 4 of the tracker were given");
    bad = poses;
    std::swap(bad.camera[1], bad.camera[2]);
    CHECK_SAYS(refusal(bad, {}), "camera's poses: the time of pose 2, 1 s, is not after");
    bad.camera[2].time_s = std::numeric_limits<double>::infinity();
    CHECK_SAYS(refusal(bad, {}), "the time of pose 2 is not finite");
    bad.camera.clear();
    CHECK_SAYS(refusal(bad, {}), "camera's poses: there are no poses");
}

TEST_CASE("row 187: streams that do not overlap") {
    TestRandom random(11);
    TestPoses poses = moving_poses({}, 10, 0, {}, random);
    for (TimedPose& pose : poses.tracker) pose.time_s += 1e9;
    const HandEyeCalibration found = calibrate(poses, {});
    CHECK(found.verdict == HandEyeVerdict::kUndetermined);
    CHECK_SAYS(found.reason, "the streams do not overlap");

    poses = moving_poses({}, 4, 0, {}, random);
    for (TimedPose& pose : poses.tracker) pose.time_s += 4.5;
    CHECK_SAYS(calibrate(poses, {}).reason, "the streams overlap by less than 3 s");
}

TEST_CASE("row 188: motions that do not show the offset") {
    TestRandom random(12);
    const TestNoise noise{0.2, 0.1};
    const auto steady = [](double time) {
        return test_pose({0.3 * std::sin(0.2 * time), 0, 0}, {0, 0, -100});
    };
    CHECK_SAYS(calibrate(moved(
                             [](double) {
                                 return test_pose({1, 0, 0}, {0, 0, -90});
                             },
                             noise, random),
                         {})
                   .reason,
               "the offset between both clocks does not show");
    CHECK(calibrate(moved(steady, noise, random), {}).verdict == HandEyeVerdict::kUndetermined);
    // A motion that repeats itself every 1.8 s.
    const auto repeated = [](double time) {
        const double phase = 3.5 * time;
        return test_pose({0.3 * std::sin(phase), 0.15 * std::cos(2 * phase), 0.2 * std::sin(phase)},
                         {0, 0, -100});
    };
    CHECK_SAYS(calibrate(moved(repeated, noise, random), {}).reason, "several offsets fit alike");
    HandEyeOptions stated;
    stated.offset_s = 0.1;
    const HandEyeCalibration found = calibrate(moved(repeated, noise, random), stated);
    CHECK(found.verdict == HandEyeVerdict::kSolved);
    CHECK(off_mm(found, {}) < 1);
    CHECK_FALSE(found.offset.is_estimated);
}

TEST_CASE("an offset beyond what is searched is no offset within it") {
    TestRandom random(13);
    const TestPoses poses = moving_poses({}, 30, 1.2, {0.2, 0.1}, random);
    HandEyeOptions options;
    options.max_offset_s = 0.5;
    CHECK(calibrate(poses, options).verdict != HandEyeVerdict::kSolved);
    CHECK(calibrate(poses, {}).offset.offset_s == doctest::Approx(1.2).epsilon(0.002));
}

namespace {

// Pearson's correlation of two series where both are known.
double direct_correlation(const std::vector<double>& a, const std::vector<double>& b,
                          std::size_t shift) {
    std::vector<double> x, y;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (std::isnan(a[i]) || std::isnan(b[i + shift])) continue;
        x.push_back(a[i]);
        y.push_back(b[i + shift]);
    }
    Eigen::ArrayXd p = Eigen::Map<Eigen::ArrayXd>(x.data(), static_cast<Eigen::Index>(x.size())),
                   q = Eigen::Map<Eigen::ArrayXd>(y.data(), static_cast<Eigen::Index>(y.size()));
    p -= p.mean();
    q -= q.mean();
    return (p * q).sum() / std::sqrt(p.square().sum() * q.square().sum());
}

}  // namespace

TEST_CASE("all correlations at once are those of one shift after the other") {
    TestRandom random(15);
    for (const std::size_t length : {1, 2, 20, 333}) {
        CAPTURE(length);
        std::vector<double> camera(length), tracker(2 * length + 31);
        for (double& speed : camera) speed = random.uniform(0, 3);
        for (double& speed : tracker) speed = 40 + random.uniform(0, 1);
        for (std::size_t i = 3; i < camera.size(); i += 7)
            camera[i] = std::numeric_limits<double>::quiet_NaN();
        std::fill_n(tracker.begin() + 5, 9, std::numeric_limits<double>::quiet_NaN());
        const std::vector<double> found = correlations(camera, tracker, 11);
        REQUIRE(found.size() == length + 32);
        for (std::size_t shift = 0; shift < found.size(); ++shift) {
            CAPTURE(shift);
            if (length <= 2)
                CHECK(std::isnan(found[shift]));  // of too few pairs
            else if (!std::isnan(found[shift]))
                CHECK(std::abs(found[shift] - direct_correlation(camera, tracker, shift)) < 1e-9);
        }
        if (length > 20) CHECK_FALSE(std::isnan(found[40]));
    }
    // A series that does not change is like none.
    std::vector<double> steady(300, 1.7), moving(400);
    for (double& speed : moving) speed = random.uniform(0, 1);
    for (const double value : correlations(steady, moving, 10)) CHECK(std::isnan(value));
    std::fill(moving.begin() + 50, moving.end(), 0.2);
    CHECK(std::isnan(
        correlations(std::vector(moving.begin(), moving.begin() + 100), moving, 10)[200]));
}

TEST_CASE("an offset of many minutes between long streams is found in seconds") {
    TestRandom random(16);
    const TestPoses poses = moving_poses({}, 1200, 1530.25, {0.2, 0.1}, random);
    const OffsetSearch found = find_offset(PoseStream(poses.camera, "camera's poses"),
                                           PoseStream(poses.tracker, "tracker's poses"), 3600);
    INFO(found.reason);
    REQUIRE(found.is_found);
    CHECK(std::abs(found.offset_s - 1530.25) < 0.01);
}

TEST_CASE("a stream with gaps and wrong poses gives transform and offset") {
    TestRandom random(14);
    const TestSetup setup;
    TestPoses poses = moving_poses(setup, 30, -0.3, {0.2, 0.1}, random);
    poses.tracker.erase(poses.tracker.begin() + 600, poses.tracker.begin() + 700);
    for (std::size_t i = 0; i < poses.camera.size(); i += 20)
        poses.camera[i].pose = test_pose(random.direction(), random.normal(60));
    const HandEyeCalibration found = calibrate(poses, {});
    CHECK(found.verdict == HandEyeVerdict::kSolved);
    CHECK(off_mm(found, setup) < 0.5);
    CHECK(found.offset.offset_s == doctest::Approx(-0.3).epsilon(0.01));
    CHECK(found.quality.poses < poses.camera.size());
    REQUIRE_FALSE(found.residual_mm.empty());
    CHECK(std::isnan(found.residual_mm[(600 + 50 - 60) * 25 / 60]));
}
