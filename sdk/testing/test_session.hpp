// A tracker of the scene in test_scene.hpp, through the C API, and everything that a frame gave as
// bytes.
#pragma once
#include <doctest/doctest.h>

#include <cstddef>
#include <functional>
#include <string>

#include "include/defrec_c.h"
#include "sdk/testing/test_scene.hpp"

#define REQUIRE_OK(call) REQUIRE_MESSAGE((call) == DEFREC_OK, defrec_last_error())

namespace defrec::test {

struct TrackingSession {
    using Change = std::function<void(defrec_rig_desc&, defrec_tracker_desc&)>;
    defrec_context context = nullptr;
    defrec_rig rig = nullptr;
    defrec_tracker tracker = nullptr;
    uint32_t format = 0, width = 0, height = 0;  // of the frames
    int64_t time = 0;

    explicit TrackingSession(
        const char* device = "cpu", uint32_t threads = 2, const Change& change = nullptr,
        const std::function<void(defrec_context_desc&)>& change_context = nullptr) {
        defrec_context_desc context_desc;
        DEFREC_INIT(&context_desc);
        context_desc.threads = threads;
        if (change_context) change_context(context_desc);
        REQUIRE_OK(defrec_context_create(&context_desc, &context));
        defrec_rig_desc rig_desc = scene_rig();
        defrec_tracker_desc tracker_desc;
        DEFREC_INIT(&tracker_desc);
        tracker_desc.device_id = device;
        tracker_desc.format = DEFREC_FORMAT_GRAY8;
        if (change) change(rig_desc, tracker_desc);
        format = tracker_desc.format;
        width = rig_desc.width;
        height = rig_desc.height;
        REQUIRE_OK(defrec_rig_create(context, &rig_desc, &rig));
        REQUIRE_OK(defrec_tracker_create(context, rig, &tracker_desc, &tracker));
    }
    ~TrackingSession() {
        defrec_tracker_destroy(tracker);
        defrec_rig_destroy(rig);
        defrec_context_destroy(context);
    }
    TrackingSession(const TrackingSession&) = delete;
    TrackingSession& operator=(const TrackingSession&) = delete;

    // An image as the application has it: pixels or memory; neither: none.
    struct Image {
        const uint8_t* pixels = nullptr;
        defrec_memory memory = nullptr;
        uint64_t stride = 0;
    };
    struct Frame {
        Image left, right, ignore;
        uint32_t flags = 0;
        defrec_memory samples = nullptr;
        uint64_t deadline_ns = 0;
        uint32_t field = DEFREC_FIELD_NONE;
    };
    using ChangeFrame = std::function<void(defrec_frame&)>;
    defrec_status submit(const Frame& given, defrec_job* job, const ChangeFrame& change = nullptr) {
        defrec_image images[3];
        const Image* sources[3] = {&given.left, &given.right, &given.ignore};
        for (int i = 0; i < 3; ++i) {
            DEFREC_INIT(&images[i]);
            images[i].format = i < 2 ? format : uint32_t{DEFREC_FORMAT_GRAY8};
            images[i].width = width;
            images[i].height = height;
            images[i].stride = sources[i]->stride;
            images[i].pixels = sources[i]->pixels;
            images[i].memory = sources[i]->memory;
        }
        defrec_frame frame;
        DEFREC_INIT(&frame);
        frame.timestamp_ns = time += 33000000;
        frame.flags = given.flags;
        frame.left = &images[0];
        frame.right = &images[1];
        frame.ignore =
            given.ignore.pixels != nullptr || given.ignore.memory != nullptr ? &images[2] : nullptr;
        frame.samples = given.samples;
        frame.deadline_ns = given.deadline_ns;
        frame.field = given.field;
        if (change) change(frame);
        return defrec_tracker_submit(tracker, &frame, job);
    }
};

// All of a frame's result but its times, to be compared bit by bit; the job is waited for and
// released.
inline std::string take_result(defrec_job job) {
    REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
    defrec_result r;
    DEFREC_INIT(&r);
    REQUIRE_OK(defrec_job_result(job, &r));
    std::string bytes;
    const auto add = [&](const void* from, size_t size) {
        bytes.append(static_cast<const char*>(from), size);
    };
    const auto add_array = [&](const auto* from, uint64_t count) {
        add(from, count * sizeof *from);
    };
    add(&r.state, offsetof(defrec_result, motions) - offsetof(defrec_result, state));
    add_array(r.motions, r.node_count);
    add_array(r.node_positions, 3 * r.node_count);
    add_array(r.vertices, 3 * r.vertex_count);
    add_array(r.normals, 3 * r.vertex_count);
    add_array(r.vertex_status, r.vertex_count);
    add_array(r.expected_error_mm, r.vertex_count);
    add_array(r.vertex_covariance, 6 * r.vertex_count);
    add_array(r.vertex_evidence, r.vertex_count);
    add(&r.view_lag_frames, offsetof(defrec_result, rig_matches) + sizeof r.rig_matches -
                                offsetof(defrec_result, view_lag_frames));
    add(&r.template_epoch, sizeof r.template_epoch);
    add(&r.faulty_views, sizeof r.faulty_views);
    add_array(r.pieces, r.piece_count);
    add_array(r.landmarks, r.landmark_count);
    add_array(r.landmark_matches, r.landmark_count);
    add_array(r.patch_observations, r.patch_count);
    if (r.disparity != nullptr) add_array(r.disparity, uint64_t{kWidth} * kHeight);
    defrec_job_release(job);
    return bytes;
}

}  // namespace defrec::test
