// For tests: a camera with a marker on it that is moved before a tracking system, with known truth.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "sdk/hand_eye/hand_eye.hpp"

namespace defrec {

constexpr double kTestDegree = std::numbers::pi / 180;

inline Eigen::Isometry3d test_pose(const Eigen::Vector3d& turn, const Eigen::Vector3d& place) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = rotation_of(turn);
    pose.translation() = place;
    return pose;
}

// A number of each kind for each trial.
class TestRandom {
  public:
    explicit TestRandom(unsigned seed) : random_(seed) {}
    Eigen::Vector3d normal(double sigma) {
        std::normal_distribution<double> draw(0, 1);
        const double x = draw(random_), y = draw(random_), z = draw(random_);
        return sigma * Eigen::Vector3d(x, y, z);
    }
    Eigen::Vector3d direction() { return normal(1).normalized(); }
    double uniform(double begin, double end) {
        return std::uniform_real_distribution<double>(begin, end)(random_);
    }

  private:
    std::mt19937 random_;
};

// Errors of both streams, along and about each axis.
struct TestNoise {
    double mm = 0, degree = 0;
    HandEyeNoise stated() const { return {mm, degree * kTestDegree, mm, degree * kTestDegree}; }
};

inline Eigen::Isometry3d noisy(const Eigen::Isometry3d& pose, TestNoise noise, TestRandom& random) {
    Eigen::Isometry3d made = pose;
    made.linear() = pose.linear() * rotation_of(random.normal(noise.degree * kTestDegree));
    made.translation() += random.normal(noise.mm);
    return made;
}

struct TestSetup {
    // A marker at the handle of an endoscope, 250 mm from the tip; the tracking system stands 1.5 m
    // away from the world that the camera sees.
    HandEyeTransforms truth{test_pose({0.3, -1.2, 0.5}, {40, -30, 250}),
                            test_pose({1.1, 0.4, -2}, {200, -100, 1500})};

    // The marker's pose by the camera's.
    Eigen::Isometry3d tracker(const Eigen::Isometry3d& camera) const {
        return truth.tracker_from_world * camera * truth.marker_from_camera.inverse();
    }
};

struct TestPoses {
    std::vector<TimedPose> camera, tracker;
    void add(double time_s, const Eigen::Isometry3d& camera_pose,
             const Eigen::Isometry3d& tracker_pose) {
        camera.push_back({time_s, camera_pose});
        tracker.push_back({time_s, tracker_pose});
    }
};

// So many still poses: turned about any axis by up to so many degrees, shifted by up to 60 mm.
inline TestPoses still_poses(const TestSetup& setup, int count, double degrees, TestNoise noise,
                             TestRandom& random) {
    TestPoses made;
    for (int i = 0; i < count; ++i) {
        const Eigen::Vector3d turn = random.uniform(0, degrees) * kTestDegree * random.direction();
        const Eigen::Vector3d shift(random.uniform(-60, 60), random.uniform(-60, 60),
                                    random.uniform(-160, -60));
        const Eigen::Isometry3d camera = test_pose(turn, shift);
        const Eigen::Isometry3d seen = noisy(camera, noise, random);
        made.add(i, seen, noisy(setup.tracker(camera), noise, random));
    }
    return made;
}

// A camera moved by hand: turns and shifts of several frequencies, none a multiple of another.
class TestHand {
  public:
    explicit TestHand(TestRandom& random) {
        for (auto& wave : waves_)
            wave = {random.uniform(0.1, 0.9), random.uniform(0, 6.28), random.uniform(0.5, 1)};
    }
    Eigen::Isometry3d at(double time_s) const {
        Eigen::Matrix<double, 6, 1> value;
        for (int i = 0; i < 6; ++i) {
            value[i] = 0;
            for (int k = 0; k < 3; ++k) {
                const auto& wave = waves_[3 * i + k];
                value[i] += wave[2] * std::sin(2 * std::numbers::pi * wave[0] * time_s + wave[1]);
            }
        }
        return test_pose(0.25 * value.head<3>(),
                         Eigen::Vector3d(0, 0, -100) + 20 * value.tail<3>());
    }

  private:
    std::array<std::array<double, 3>, 18> waves_{};
};

// tracking system's time = camera's time + offset_s
inline TestPoses moving_poses(const TestSetup& setup, double length_s, double offset_s,
                              TestNoise noise, TestRandom& random) {
    const TestHand hand(random);
    TestPoses made;
    constexpr double kCameraInterval = 1.0 / 25, kTrackerInterval = 1.0 / 60;
    for (double time = 0; time < length_s; time += kCameraInterval)
        made.camera.push_back({time, noisy(hand.at(time), noise, random)});
    for (double time = -1; time < length_s + 1; time += kTrackerInterval)
        made.tracker.push_back(
            {time + offset_s, noisy(setup.tracker(hand.at(time)), noise, random)});
    return made;
}

}  // namespace defrec
