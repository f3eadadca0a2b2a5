// Hand-eye calibration through the C API: what it gives, what is refused with which words. How
// exact it is: sdk/hand_eye.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "sdk/hand_eye/test_motion.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec::test;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <class Struct>
Struct init() {
    Struct made;
    DEFREC_INIT(&made);
    return made;
}

void add_pose(const Eigen::Isometry3d& pose, std::vector<double>& values) {
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column) values.push_back(pose.matrix()(row, column));
}

// Poses as an application has them.
struct Poses {
    std::vector<double> camera, camera_times, tracker, tracker_times;

    explicit Poses(const defrec::TestPoses& poses) {
        for (const defrec::TimedPose& pose : poses.camera) {
            add_pose(pose.pose, camera);
            camera_times.push_back(pose.time_s);
        }
        for (const defrec::TimedPose& pose : poses.tracker) {
            add_pose(pose.pose, tracker);
            tracker_times.push_back(pose.time_s);
        }
    }
    defrec_hand_eye_desc desc(uint32_t flags) const {
        auto made = init<defrec_hand_eye_desc>();
        made.flags = flags;
        made.camera_poses = camera.data();
        made.camera_times_s = camera_times.data();
        made.camera_count = camera_times.size();
        made.tracker_poses = tracker.data();
        made.tracker_times_s = tracker_times.data();
        made.tracker_count = tracker_times.size();
        return made;
    }
};

const Poses& still() {
    static const Poses made = [] {
        defrec::TestRandom random(1);
        return Poses(defrec::still_poses({}, 12, 60, {0.1, 0.05}, random));
    }();
    return made;
}

// A handle that ends itself.
class TestHandEye {
  public:
    explicit TestHandEye(const defrec_hand_eye_desc& desc) {
        REQUIRE_OK(defrec_hand_eye_create(&desc, &handle_));
    }
    ~TestHandEye() { defrec_hand_eye_destroy(handle_); }
    TestHandEye(const TestHandEye&) = delete;
    TestHandEye& operator=(const TestHandEye&) = delete;

    defrec_hand_eye get() const { return handle_; }
    defrec_hand_eye_info info() const {
        auto made = init<defrec_hand_eye_info>();
        REQUIRE_OK(defrec_hand_eye_get(handle_, &made));
        return made;
    }

  private:
    defrec_hand_eye handle_ = nullptr;
};

}  // namespace

TEST_CASE("poses in pairs: the transform, residuals, and the camera's pose that follows") {
    defrec_hand_eye_desc desc = still().desc(DEFREC_HAND_EYE_PAIRED);
    desc.camera_times_s = desc.tracker_times_s = nullptr;
    const TestHandEye hand_eye(desc);
    const defrec_hand_eye_info info = hand_eye.info();
    const defrec::TestSetup setup;
    CHECK(info.verdict == DEFREC_VERDICT_ACCEPTED);
    CHECK(std::string(info.reason).size() > 10);
    CHECK(std::string(info.notes).empty());
    for (int row = 0; row < 3; ++row)
        CHECK(std::abs(info.marker_from_camera[4 * row + 3] -
                       setup.truth.marker_from_camera.translation()[row]) < 1);
    CHECK(info.is_solved == 1);
    CHECK(info.offset_estimated == 0);
    CHECK(info.residual_count == 12);
    CHECK(info.used == 12);
    for (size_t i = 0; i < info.residual_count; ++i) {
        CHECK(info.residuals_mm[i] < 1);
        CHECK(info.residuals_rad[i] < 0.02);
        CHECK(info.inliers[i] == 1);
    }
    CHECK(std::sqrt(info.covariance[0]) < 0.01);
    CHECK(info.covariance[1] == doctest::Approx(info.covariance[6]));
    CHECK(info.length_factor == doctest::Approx(1).epsilon(0.02));

    const Eigen::Isometry3d camera = defrec::test_pose({0.2, 0.1, -0.3}, {10, 20, -90});
    std::vector<double> pose;
    add_pose(setup.tracker(camera), pose);
    REQUIRE_OK(defrec_hand_eye_camera_pose(hand_eye.get(), pose.data(), 1, pose.data()));
    const Eigen::Isometry3d truth = setup.truth.tracker_from_world * camera;
    for (int row = 0; row < 3; ++row) {
        CHECK(std::abs(pose[4 * static_cast<size_t>(row) + 3] - truth.translation()[row]) < 1);
        CHECK(std::abs(pose[4 * static_cast<size_t>(row)] - truth.linear()(row, 0)) < 0.01);
    }
}

TEST_CASE("streams: the offset between two clocks, or a stated one") {
    defrec::TestRandom random(2);
    const Poses moving(defrec::moving_poses({}, 20, 0.25, {0.2, 0.1}, random));
    const TestHandEye found(moving.desc(0));
    const defrec_hand_eye_info info = found.info();
    CHECK(info.verdict == DEFREC_VERDICT_ACCEPTED);
    CHECK(info.offset_estimated == 1);
    CHECK(std::abs(info.offset_s - 0.25) < 0.005);
    CHECK(info.offset_sigma_s < 0.002);
    CHECK(info.offset_correlation > 0.75);
    defrec_hand_eye_desc desc = moving.desc(DEFREC_HAND_EYE_KNOWN_OFFSET);
    desc.offset_s = 0.25;
    const TestHandEye stated(desc);
    CHECK(stated.info().verdict == DEFREC_VERDICT_ACCEPTED);
    CHECK(stated.info().offset_estimated == 0);
    CHECK(stated.info().offset_s == 0.25);
}

TEST_CASE("row 191: a calibration that was refused has a reason, and gives no camera's pose") {
    defrec::TestRandom random(3);
    const Poses shifted(defrec::still_poses({}, 12, 0, {0.1, 0.05}, random));
    const TestHandEye hand_eye(shifted.desc(DEFREC_HAND_EYE_PAIRED));
    const defrec_hand_eye_info info = hand_eye.info();
    CHECK(info.verdict == DEFREC_VERDICT_UNDETERMINED);
    CHECK(info.is_solved == 0);
    CHECK(info.residuals_mm == nullptr);
    CHECK(info.residual_count == 0);
    CHECK(std::isnan(info.covariance[0]));
    REQUIRE(info.free_motion_count == 3);
    auto motion = init<defrec_free_motion>();
    REQUIRE_OK(defrec_hand_eye_get_free_motion(hand_eye.get(), 2, &motion));
    CHECK(motion.kind == DEFREC_FREE_SHIFT);
    CHECK(motion.axis[2] == 1);
    CHECK(motion.expected_mm == 1000);
    CHECK(motion.expected_rad == 0);
    CHECK(contains(motion.text, "shift along"));
    CHECK(defrec_hand_eye_get_free_motion(hand_eye.get(), 3, &motion) == DEFREC_ERROR_ARGUMENT);
    std::vector<double> pose;
    add_pose(Eigen::Isometry3d::Identity(), pose);
    double out[12] = {-1};
    CHECK(defrec_hand_eye_camera_pose(hand_eye.get(), pose.data(), 1, out) == DEFREC_ERROR_STATE);
    CHECK(contains(defrec_last_error(), info.reason));
    CHECK(out[0] == -1);
    double covariance[36] = {-1};
    CHECK(defrec_hand_eye_pose_covariance(hand_eye.get(), pose.data(), 1, covariance) ==
          DEFREC_ERROR_STATE);
    CHECK(covariance[0] == -1);
}

TEST_CASE("row 190: arrays that are missing, numbers out of range, some of four errors") {
    using Change = std::function<void(defrec_hand_eye_desc&)>;
    using Desc = defrec_hand_eye_desc;
    Poses bad = still();
    bad.camera[2 * 12 + 3] = kNaN;
    bad.tracker[3 * 12] += 0.5;
    bad.camera_times[4] = 0;
    const std::vector<std::pair<Change, const char*>> cases = {
        {[](Desc& d) { d.flags = 4; }, "desc.flags is 4"},
        {[](Desc& d) { d.camera_poses = nullptr; }, "desc.camera_poses is NULL"},
        {[](Desc& d) { d.tracker_poses = nullptr; }, "desc.tracker_poses is NULL"},
        {[](Desc& d) { d.flags = 0, d.camera_times_s = nullptr; }, "desc.camera_times_s is NULL"},
        {[](Desc& d) { d.flags = 0, d.tracker_times_s = nullptr; }, "desc.tracker_times_s is NULL"},
        {[](Desc& d) { d.camera_count = 0; }, "desc.camera_count is 0"},
        {[](Desc& d) { d.tracker_count = UINT64_MAX; }, "desc.tracker_count is"},
        {[](Desc& d) { d.tracker_count = 11; }, "12 poses of the camera and 11 of the tracker"},
        {[](Desc& d) { d.camera_error_mm = 0.1; }, "1 of the four errors in desc are given"},
        {[](Desc& d) { d.tracker_error_rad = -1; }, "desc.tracker_error_rad is -1"},
        {[](Desc& d) { d.offset_s = kNaN; }, "desc.offset_s is nan"},
        {[](Desc& d) { d.max_offset_s = 1e9; }, "desc.max_offset_s is"},
        {[](Desc& d) { d.max_residual_rad = 4; }, "desc.max_residual_rad is 4"},
        {[](Desc& d) { d.max_error_mm = -1; }, "desc.max_error_mm is -1"},
        {[&](Desc& d) { d.camera_poses = bad.camera.data(); }, "camera's poses: pose 2 is not"},
        {[&](Desc& d) { d.tracker_poses = bad.tracker.data(); }, "tracker's poses: pose 3 is no"},
        {[&](Desc& d) { d.flags = 0, d.camera_times_s = bad.camera_times.data(); },
         "camera's poses: the time of pose 4"},
    };
    for (const auto& [change, said] : cases) {
        defrec_hand_eye_desc desc = still().desc(DEFREC_HAND_EYE_PAIRED);
        change(desc);
        defrec_hand_eye made = nullptr;
        CHECK(defrec_hand_eye_create(&desc, &made) == DEFREC_ERROR_ARGUMENT);
        CHECK(made == nullptr);
        const std::string message = defrec_last_error();
        CHECK_MESSAGE(contains(message, said), message);
    }
    defrec_hand_eye_desc desc = still().desc(DEFREC_HAND_EYE_PAIRED);
    CHECK(defrec_hand_eye_create(&desc, nullptr) == DEFREC_ERROR_ARGUMENT);
    defrec_hand_eye made = nullptr;
    CHECK(defrec_hand_eye_create(nullptr, &made) == DEFREC_ERROR_ARGUMENT);
    desc.struct_size = 0;
    CHECK(defrec_hand_eye_create(&desc, &made) == DEFREC_ERROR_VERSION);
    CHECK(made == nullptr);
}

TEST_CASE("row 190: a marker's pose that is none, and outputs that are missing") {
    const TestHandEye hand_eye(still().desc(DEFREC_HAND_EYE_PAIRED));
    std::vector<double> poses;
    add_pose(Eigen::Isometry3d::Identity(), poses);
    add_pose(Eigen::Isometry3d::Identity(), poses);
    double out[24] = {-1};
    const defrec_hand_eye h = hand_eye.get();
    CHECK(defrec_hand_eye_camera_pose(h, nullptr, 1, out) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_hand_eye_camera_pose(h, poses.data(), 1, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_hand_eye_camera_pose(h, nullptr, 0, nullptr) == DEFREC_OK);
    CHECK(defrec_hand_eye_camera_pose(h, poses.data(), SIZE_MAX, out) == DEFREC_ERROR_ARGUMENT);
    poses[12] = 3;
    CHECK(defrec_hand_eye_camera_pose(h, poses.data(), 2, out) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "marker_pose: pose 1 is no rotation"));
    CHECK(out[0] == -1);
    double covariances[72] = {-1};
    CHECK(defrec_hand_eye_pose_covariance(h, poses.data(), 2, covariances) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_hand_eye_pose_covariance(h, nullptr, 1, covariances) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_hand_eye_pose_covariance(h, poses.data(), 1, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_hand_eye_pose_covariance(h, poses.data(), SIZE_MAX, covariances) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_hand_eye_pose_covariance(h, nullptr, 0, nullptr) == DEFREC_OK);
    CHECK(covariances[0] == -1);
    // The same for each of two.
    std::copy(poses.begin(), poses.begin() + 12, poses.begin() + 12);
    REQUIRE_OK(defrec_hand_eye_pose_covariance(h, poses.data(), 2, covariances));
    CHECK(covariances[0] > 0);
    CHECK(std::equal(covariances, covariances + 36, covariances + 36));
    CHECK(defrec_hand_eye_get(h, nullptr) == DEFREC_ERROR_ARGUMENT);
}

TEST_CASE("row 16: a calibration's handle: NULL, destroyed, foreign") {
    const defrec_hand_eye_desc desc = still().desc(DEFREC_HAND_EYE_PAIRED);
    defrec_hand_eye hand_eye = nullptr;
    REQUIRE_OK(defrec_hand_eye_create(&desc, &hand_eye));
    auto info = init<defrec_hand_eye_info>();
    auto registration = init<defrec_registration_info>();
    CHECK(defrec_registration_get(reinterpret_cast<defrec_registration>(hand_eye), &registration) ==
          DEFREC_ERROR_HANDLE);
    CHECK(contains(defrec_last_error(), "a hand-eye calibration handle was given"));
    CHECK(defrec_hand_eye_get(nullptr, &info) == DEFREC_ERROR_ARGUMENT);
    defrec_hand_eye_destroy(hand_eye);
    defrec_hand_eye_destroy(hand_eye);
    CHECK(contains(defrec_last_error(), "destroyed already"));
    defrec_hand_eye_destroy(nullptr);
    auto motion = init<defrec_free_motion>();
    double pose[12] = {};
    CHECK(defrec_hand_eye_get(hand_eye, &info) == DEFREC_ERROR_HANDLE);
    CHECK(defrec_hand_eye_get_free_motion(hand_eye, 0, &motion) == DEFREC_ERROR_HANDLE);
    CHECK(defrec_hand_eye_camera_pose(hand_eye, pose, 1, pose) == DEFREC_ERROR_HANDLE);
    double covariance[36] = {};
    CHECK(defrec_hand_eye_pose_covariance(hand_eye, pose, 1, covariance) == DEFREC_ERROR_HANDLE);
}
