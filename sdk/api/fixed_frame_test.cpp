// Results in the fixed frame of the camera's pose, through the C API: where they are, how far off
// they may be, what is refused. How exactly a calibration is known: sdk/hand_eye/trials_test.cpp.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "sdk/testing/plane_tracker.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_scene.hpp"

using namespace defrec::test;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using RowMajor6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

Eigen::Isometry3d pose_of(const Eigen::Vector3d& turn, const Eigen::Vector3d& place) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    if (turn.norm() > 0) pose.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).matrix();
    pose.translation() = place;
    return pose;
}

// The camera by a navigation system that stands 1.2 m away.
const Eigen::Isometry3d kPose = pose_of({0.4, -1.1, 0.7}, {300, -150, 1150});

void give(const Eigen::Isometry3d& pose, defrec_frame& frame) {
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
            frame.camera_pose[4 * row + column] = pose.matrix()(row, column);
    frame.flags |= DEFREC_FRAME_CAMERA_POSE;
}

// A frame with the pose, released with the object.
class PosedFrame {
  public:
    PosedFrame() : job_(tracker_.track(0, 0, [](defrec_frame& frame) { give(kPose, frame); })) {}
    ~PosedFrame() { defrec_job_release(job_); }
    PosedFrame(const PosedFrame&) = delete;
    PosedFrame& operator=(const PosedFrame&) = delete;
    defrec_job get() const { return job_; }
    PlaneTracker& tracker() { return tracker_; }

  private:
    PlaneTracker tracker_{DEFREC_BODY_OFF};
    defrec_job job_;
};

Eigen::Matrix3d symmetric(const double* values) {
    Eigen::Matrix3d made;
    made << values[0], values[1], values[2], values[1], values[3], values[4], values[2], values[4],
        values[5];
    return made;
}

}  // namespace

TEST_CASE("points and covariances of a frame in the fixed frame of its pose") {
    const PosedFrame frame;
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(frame.get(), &result));
    REQUIRE(result.vertex_count > 50);
    const size_t count = result.vertex_count;
    const std::vector<double> camera(result.vertices, result.vertices + 3 * count),
        errors(result.vertex_covariance, result.vertex_covariance + 6 * count);
    std::vector<double> xyz(3 * count, -1), covariance(6 * count, -1);
    REQUIRE_OK(defrec_job_to_fixed_frame(frame.get(), nullptr, count, camera.data(), errors.data(),
                                         xyz.data(), covariance.data()));
    for (size_t i = 0; i < count; ++i) {
        const Eigen::Vector3d place = kPose * Eigen::Vector3d(&camera[3 * i]);
        CHECK((Eigen::Vector3d(&xyz[3 * i]) - place).norm() < 1e-9);
        const Eigen::Matrix3d turned =
            kPose.rotation() * symmetric(&errors[6 * i]) * kPose.rotation().transpose();
        CHECK((symmetric(&covariance[6 * i]) - turned).norm() < 1e-9 * turned.norm());
    }
    // In place, and without covariances.
    std::vector<double> same = camera, both = errors;
    REQUIRE_OK(defrec_job_to_fixed_frame(frame.get(), nullptr, count, same.data(), both.data(),
                                         same.data(), both.data()));
    CHECK(same == xyz);
    CHECK(both == covariance);
    same = camera;
    REQUIRE_OK(defrec_job_to_fixed_frame(frame.get(), nullptr, count, same.data(), nullptr,
                                         same.data(), nullptr));
    CHECK(same == xyz);
    REQUIRE_OK(
        defrec_job_to_fixed_frame(frame.get(), nullptr, 0, nullptr, nullptr, nullptr, nullptr));
    const double lost[] = {1, kNaN, 2};
    double there[3] = {}, its_errors[6] = {};
    REQUIRE_OK(
        defrec_job_to_fixed_frame(frame.get(), nullptr, 1, lost, nullptr, there, its_errors));
    for (const double coordinate : there) CHECK(std::isnan(coordinate));
}

TEST_CASE("the pose's error is added as it moves a point, and is as large as it is drawn") {
    constexpr int kDraws = 40000;
    const PosedFrame frame;
    std::mt19937 random(3);
    std::normal_distribution<double> normal(0, 1);
    // Correlated errors of 0.1 degrees and 0.3 mm.
    RowMajor6 root;
    for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = normal(random);
    root.topRows<3>() *= 0.7e-3;
    root.bottomRows<3>() *= 0.12;
    const RowMajor6 pose_error = root * root.transpose();
    const Eigen::Vector3d camera(12, -7, 90);
    const double point_error[] = {0.04, 0.01, 0, 0.03, -0.02, 0.25};
    double xyz[3] = {}, covariance[6] = {};
    REQUIRE_OK(defrec_job_to_fixed_frame(frame.get(), pose_error.data(), 1, camera.data(),
                                         point_error, xyz, covariance));
    const Eigen::Matrix3d point_root = symmetric(point_error).llt().matrixL().toDenseMatrix();
    Eigen::Matrix3d drawn = Eigen::Matrix3d::Zero();
    for (int i = 0; i < kDraws; ++i) {
        Eigen::Matrix<double, 6, 1> numbers;
        for (double& number : numbers) number = normal(random);
        const Eigen::Matrix<double, 6, 1> twist = root * numbers;
        Eigen::Isometry3d truth = kPose;
        truth.linear() = pose_of(twist.head<3>(), {0, 0, 0}).linear() * kPose.linear();
        truth.translation() += twist.tail<3>();
        Eigen::Vector3d shares;
        for (double& share : shares) share = normal(random);
        const Eigen::Vector3d off = truth * (camera + point_root * shares) - Eigen::Vector3d(xyz);
        drawn += off * off.transpose() / kDraws;
    }
    const Eigen::Matrix3d stated = symmetric(covariance);
    CHECK((drawn - stated).norm() < 0.03 * stated.norm());
    // The pose's share is a part of it that shows.
    CHECK(stated.trace() > 1.2 * symmetric(point_error).trace());
}

TEST_CASE("a frame without a pose, and what is no covariance, are refused") {
    PosedFrame frame;
    const double point[] = {1, 2, 80};
    double xyz[3] = {-1, -1, -1};
    const auto carry = [&](defrec_job job, const double* pose_covariance) {
        return defrec_job_to_fixed_frame(job, pose_covariance, 1, point, nullptr, xyz, nullptr);
    };
    const defrec_job without = frame.tracker().track(0, 0);
    CHECK(carry(without, nullptr) == DEFREC_ERROR_STATE);
    CHECK(contains(defrec_last_error(), "camera_pose"));
    defrec_job_release(without);
    CHECK(carry(without, nullptr) == DEFREC_ERROR_HANDLE);
    using Fault = std::function<void(RowMajor6&)>;
    for (const Fault& fault :
         {Fault([](RowMajor6& m) { m(2, 2) = -1e-9; }), Fault([](RowMajor6& m) { m(1, 4) = 0.5; }),
          Fault([](RowMajor6& m) { m(1, 4) = m(4, 1) = 1.1; }),
          Fault([](RowMajor6& m) { m(0, 0) = kNaN; })}) {
        RowMajor6 covariance = RowMajor6::Identity();
        fault(covariance);
        CHECK(carry(frame.get(), covariance.data()) == DEFREC_ERROR_ARGUMENT);
        CHECK(contains(defrec_last_error(), "pose_covariance"));
    }
    CHECK(defrec_job_to_fixed_frame(frame.get(), nullptr, 1, nullptr, nullptr, xyz, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_job_to_fixed_frame(frame.get(), nullptr, 1, point, nullptr, nullptr, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_job_to_fixed_frame(frame.get(), nullptr, SIZE_MAX, point, nullptr, xyz, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(xyz[0] == -1);
    REQUIRE_OK(carry(frame.get(), RowMajor6(RowMajor6::Identity()).data()));
    CHECK((Eigen::Vector3d(xyz) - kPose * Eigen::Vector3d(point)).norm() < 1e-9);
}

TEST_CASE("each frame has its own pose, also while others wait") {
    PosedFrame frame;
    const Eigen::Isometry3d other = pose_of({0, 0, 1}, {10, 20, 30});
    defrec_job next = nullptr;
    REQUIRE_OK(
        frame.tracker().submit(0, 0, &next, [&](defrec_frame& given) { give(other, given); }));
    const double point[] = {1, 2, 80};
    for (const auto& [job, pose] : {std::pair{frame.get(), kPose}, std::pair{next, other}}) {
        double xyz[3] = {};
        REQUIRE_OK(defrec_job_to_fixed_frame(job, nullptr, 1, point, nullptr, xyz, nullptr));
        CHECK((Eigen::Vector3d(xyz) - pose * Eigen::Vector3d(point)).norm() < 1e-9);
    }
    defrec_job_release(next);
}
