// A tracker of the scene in test_scene.hpp that is given a pair of gray images for each frame, and
// what came of the frame as values.
#pragma once
#include <algorithm>
#include <vector>

#include "sdk/testing/test_session.hpp"

namespace defrec::test {

struct PairSession : TrackingSession {
    using TrackingSession::TrackingSession;

    defrec_status submit(const Pair& pair, defrec_job* job,
                         const std::vector<uint8_t>* ignore = nullptr, uint32_t flags = 0) {
        TrackingSession::Frame frame;
        frame.left.pixels = pair.left.data();
        frame.right.pixels = pair.right.data();
        frame.ignore.pixels = ignore != nullptr ? ignore->data() : nullptr;
        frame.flags = flags;
        return TrackingSession::submit(frame, job);
    }
    // One frame from submission to result; the job is released.
    struct Frame {
        uint32_t state, reasons, faulty_views, epoch, patches, features, age;
        float largest_error;  // that is expected, mm
        std::vector<float> vertices;
        std::vector<uint8_t> status;
        double shift[3];
    };
    Frame track(const Pair& pair, const std::vector<uint8_t>* ignore = nullptr,
                uint32_t flags = 0) {
        defrec_job job = nullptr;
        REQUIRE_OK(submit(pair, &job, ignore, flags));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        Frame frame{result.state,
                    result.reasons,
                    result.faulty_views,
                    result.epoch,
                    result.patches,
                    result.features,
                    result.age,
                    0,
                    {},
                    {},
                    {0, 0, 0}};
        if (result.vertex_count > 0) {
            frame.vertices.assign(result.vertices, result.vertices + 3 * result.vertex_count);
            frame.status.assign(result.vertex_status, result.vertex_status + result.vertex_count);
            frame.largest_error = *std::max_element(result.expected_error_mm,
                                                    result.expected_error_mm + result.vertex_count);
            const double centre[3] = {0, 0, kDepth};
            double moved[3];
            REQUIRE_OK(defrec_job_warp_points(job, centre, 1, moved, nullptr, nullptr));
            for (int axis = 0; axis < 3; ++axis) frame.shift[axis] = moved[axis] - centre[axis];
        }
        defrec_job_release(job);
        return frame;
    }
};

inline bool usable(uint32_t state) {
    return state == DEFREC_TRACKING || state == DEFREC_DEGRADED || state == DEFREC_RELOCALISED;
}

}  // namespace defrec::test
