// What threads of little stack may call besides the tracker, whose own test is in
// sdk/tracking/tracker_test.cpp.
#include <doctest/doctest.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "sdk/hand_eye/test_motion.hpp"
#include "sdk/registration/test_organ.hpp"
#include "sdk/testing/plane_tracker.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"

using namespace defrec::test;

namespace {

template <class Struct>
Struct init() {
    Struct made;
    DEFREC_INIT(&made);
    return made;
}

void on_small_stack(const std::function<void()>& body) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    constexpr size_t kStack = 1 << 20;  // a sanitizer's frames are larger
#else
    constexpr size_t kStack = 64 << 10;
#endif
    const auto run = [](void* given) -> void* {
        (*static_cast<const std::function<void()>*>(given))();
        return nullptr;
    };
    pthread_attr_t attributes;
    REQUIRE(pthread_attr_init(&attributes) == 0);
    const auto least = static_cast<size_t>(sysconf(_SC_THREAD_STACK_MIN));
    REQUIRE(pthread_attr_setstacksize(&attributes, std::max(kStack, least)) == 0);
    pthread_t thread;
    REQUIRE(pthread_create(&thread, &attributes, run,
                           const_cast<void*>(static_cast<const void*>(&body))) == 0);
    REQUIRE(pthread_join(thread, nullptr) == 0);
    pthread_attr_destroy(&attributes);
}

// An organ and what a camera sees of it, with one thread: the caller's.
struct Organ {
    defrec::TestMesh mesh = defrec::organ_mesh(3);
    defrec::TestView view;
    TestContext context{{}, 1};

    Organ() {
        std::mt19937 random(7);
        const defrec::Pose truth = defrec::organ_pose(random, 110, 0.3);
        view = defrec::TestCamera(mesh, truth, {}).view(mesh, random);
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column)
                start[4 * row + column] = truth.rotation(row, column);
            start[4 * row + 3] = truth.translation[row];
        }
    }
    double start[12];
};

void expect_accepted(defrec_registration registration) {
    auto info = init<defrec_registration_info>();
    REQUIRE_OK(defrec_registration_get(registration, &info));
    CHECK(info.verdict == DEFREC_VERDICT_ACCEPTED);
    const double model[3] = {10, 5, 40};
    double xyz[3], covariance[6], error = 0;
    REQUIRE_OK(defrec_registration_move_points(registration, model, 1, xyz, covariance, &error));
    CHECK(std::isfinite(error));
}

void add_pose(const Eigen::Isometry3d& pose, std::vector<double>& values) {
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column) values.push_back(pose.matrix()(row, column));
}

void calibrate(const defrec::TestPoses& poses, uint32_t flags) {
    std::vector<double> camera, camera_times, tracker, tracker_times;
    for (const defrec::TimedPose& pose : poses.camera) {
        add_pose(pose.pose, camera);
        camera_times.push_back(pose.time_s);
    }
    for (const defrec::TimedPose& pose : poses.tracker) {
        add_pose(pose.pose, tracker);
        tracker_times.push_back(pose.time_s);
    }
    auto desc = init<defrec_hand_eye_desc>();
    desc.flags = flags;
    desc.camera_poses = camera.data();
    desc.camera_times_s = camera_times.data();
    desc.camera_count = camera_times.size();
    desc.tracker_poses = tracker.data();
    desc.tracker_times_s = tracker_times.data();
    desc.tracker_count = tracker_times.size();
    defrec_hand_eye made = nullptr;
    REQUIRE_OK(defrec_hand_eye_create(&desc, &made));
    auto info = init<defrec_hand_eye_info>();
    REQUIRE_OK(defrec_hand_eye_get(made, &info));
    CHECK(info.verdict == DEFREC_VERDICT_ACCEPTED);
    REQUIRE_OK(defrec_hand_eye_camera_pose(made, tracker.data(), 1, camera.data()));
    defrec_hand_eye_destroy(made);
}

}  // namespace

TEST_CASE("row 101: threads of 64 KiB of stack may predict a thousand points") {
    constexpr size_t kPoints = 1000;
    constexpr int kFrames = 60;
    constexpr int64_t kPeriod = 33'333'333;  // ns
    std::vector<double> xyz(3 * kPoints), error(kPoints, 0.1);
    std::vector<uint8_t> status(kPoints), basis(kPoints);
    on_small_stack([&] {
        auto desc = init<defrec_predictor_desc>();
        desc.point_count = kPoints;
        defrec_predictor predictor = nullptr;
        REQUIRE_OK(defrec_predictor_create(&desc, &predictor));
        for (int k = 0; k < kFrames; ++k) {
            for (size_t i = 0; i < xyz.size(); ++i)
                xyz[i] = std::sin(0.3 * k + static_cast<double>(i));
            auto frame = init<defrec_predictor_frame>();
            frame.state = DEFREC_TRACKING;
            frame.epoch = 1;
            frame.timestamp_ns = k * kPeriod;
            frame.xyz = xyz.data();
            frame.status = status.data();
            frame.expected_error_mm = error.data();
            frame.count = kPoints;
            REQUIRE_OK(defrec_predictor_add_frame(predictor, &frame));
        }
        REQUIRE_OK(defrec_predictor_predict(predictor, kFrames * kPeriod, kPoints, xyz.data(),
                                            status.data(), error.data(), basis.data()));
        CHECK(basis[0] == DEFREC_PREDICTED_LEARNED);
        defrec_predictor_destroy(predictor);
    });
}

TEST_CASE("row 101: threads of 64 KiB of stack may register a model, and deform it") {
    const Organ organ;
    on_small_stack([&] {
        auto desc = init<defrec_registration_desc>();
        desc.model_vertices = organ.mesh.vertices.data();
        desc.model_vertex_count = organ.mesh.vertices.size() / 3;
        desc.model_triangles = organ.mesh.triangles.data();
        desc.model_triangle_count = organ.mesh.triangles.size() / 3;
        desc.seen_vertices = organ.view.places.data();
        desc.seen_covariances = organ.view.covariances.data();
        desc.seen_count = organ.view.places.size() / 3;
        std::copy_n(organ.start, 12, desc.start);
        for (const uint32_t flags : {0u, static_cast<uint32_t>(DEFREC_REGISTRATION_ELASTIC)}) {
            desc.flags = flags;
            defrec_registration made = nullptr;
            REQUIRE_OK(defrec_registration_from_surface(organ.context.get(), &desc, &made));
            expect_accepted(made);
            defrec_registration_destroy(made);
        }
    });
}

TEST_CASE("row 101: threads of 64 KiB of stack may calibrate a camera on its marker") {
    defrec::TestRandom random(1);
    const defrec::TestPoses still = defrec::still_poses({}, 12, 60, {0.1, 0.05}, random),
                            moving = defrec::moving_poses({}, 20, 0.25, {0.2, 0.1}, random);
    on_small_stack([&] {
        calibrate(still, DEFREC_HAND_EYE_PAIRED);
        calibrate(moving, 0);
    });
}

TEST_CASE("row 101: threads of 64 KiB of stack may make, load and move plans and points") {
    PlaneTracker tracker;
    const TemporaryFolder folder;
    const std::string path = (folder.path() / "plan").string();
    // The model's frame is the template's.
    const double places[] = {-20, -15, 80, 15, -12, 82, -18, 14, 78, 17, 16, 86, 0, 0, 92};
    constexpr size_t kCount = 5;
    defrec_job job = tracker.track(0.5, 0.2);
    on_small_stack([&] {
        auto pairs = init<defrec_registration_pairs>();
        pairs.model_xyz = pairs.seen_xyz = places;
        pairs.count = kCount;
        defrec_registration registration = nullptr;
        REQUIRE_OK(defrec_registration_from_pairs(&pairs, &registration));
        expect_accepted(registration);
        auto desc = init<defrec_plan_desc>();
        desc.targets = places;
        desc.target_count = kCount;
        defrec_plan plan = nullptr, loaded = nullptr;
        REQUIRE_OK(defrec_plan_create(tracker.surface(), registration, &desc, &plan));
        REQUIRE_OK(defrec_plan_save(plan, path.c_str()));
        REQUIRE_OK(defrec_plan_load(tracker.surface(), path.c_str(), &loaded));
        double xyz[3 * kCount], covariance[6 * kCount], error[kCount];
        uint8_t status[kCount];
        REQUIRE_OK(defrec_job_move_plan(job, loaded, kCount, xyz, covariance, status, error));
        REQUIRE_OK(defrec_job_warp_points(job, places, kCount, xyz, status, error));
        REQUIRE_OK(defrec_job_point_covariances(job, places, kCount, covariance, nullptr));
        CHECK(std::abs(xyz[12] - 0.5) < 0.6);
        defrec_plan_destroy(plan);
        defrec_plan_destroy(loaded);
        defrec_registration_destroy(registration);
    });
    defrec_job_release(job);
}
