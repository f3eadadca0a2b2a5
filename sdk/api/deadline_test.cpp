// Frames with a deadline, on the CPU. Which quality level is chosen:
// sdk/tracking/quality_level_test.cpp.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "sdk/testing/test_session.hpp"

using namespace defrec::test;

namespace {

constexpr uint32_t kOfDeadlines =
    DEFREC_REASON_COARSE | DEFREC_REASON_UNCHECKED | DEFREC_REASON_OVERDUE;

// Each view's pixels are copied before the call returns.
defrec_job submit(TrackingSession& session, const Pair& pair, uint64_t deadline_ns) {
    TrackingSession::Frame frame;
    frame.left.pixels = pair.left.data();
    frame.right.pixels = pair.right.data();
    frame.deadline_ns = deadline_ns;
    defrec_job job = nullptr;
    REQUIRE_OK(session.submit(frame, &job));
    return job;
}

defrec_result result_of(defrec_job job) {
    REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(job, &result));
    return result;
}

// Mean motion of all vertices since the template, along x.
double mean_motion(const defrec_result& result, const defrec_result& first) {
    double sum = 0;
    for (uint64_t i = 0; i < result.vertex_count; ++i)
        sum += result.vertices[3 * i] - first.vertices[3 * i];
    return sum / static_cast<double>(result.vertex_count);
}

}  // namespace

TEST_CASE("a frame that is late before it begins is followed, late and unchecked, and says so") {
    TrackingSession session("cpu", 2, [](defrec_rig_desc&, defrec_tracker_desc& tracker) {
        tracker.frames_in_flight = 4;
    });
    const defrec_job first_job = submit(session, render(0, 0), 0),
                     late_job = submit(session, render(1, 0), 1),
                     next_job = submit(session, render(1, 0), 0);
    const defrec_result first = result_of(first_job), late = result_of(late_job),
                        next = result_of(next_job);
    CHECK((first.reasons & kOfDeadlines) == 0);
    CHECK((next.reasons & kOfDeadlines) == 0);
    CHECK(next.state == DEFREC_TRACKING);

    CHECK((late.reasons & kOfDeadlines) == kOfDeadlines);
    CHECK(late.state == DEFREC_DEGRADED);
    CHECK(late.observed_share == 0);
    CHECK(std::all_of(late.vertex_status, late.vertex_status + late.vertex_count,
                      [](uint8_t status) { return status == DEFREC_POINT_UNKNOWN; }));
    CHECK(std::none_of(
        late.vertex_evidence, late.vertex_evidence + late.vertex_count,
        [](uint8_t evidence) { return (evidence & DEFREC_EVIDENCE_PHOTOMETRIC) != 0; }));
    CHECK(mean_motion(late, first) == doctest::Approx(mean_motion(next, first)).epsilon(0.1));
    REQUIRE(late.vertex_count == next.vertex_count);
    uint64_t less_sure = 0;
    for (uint64_t i = 0; i < late.vertex_count; ++i)
        less_sure += late.expected_error_mm[i] > next.expected_error_mm[i];
    CHECK(less_sure == late.vertex_count);
    for (const defrec_job job : {first_job, late_job, next_job}) defrec_job_release(job);
}

TEST_CASE("a deadline that is far off changes no bit") {
    TrackingSession without, with;
    for (int i = 0; i < 3; ++i) {
        const Pair pair = render(0.5 * i, 0.2 * i);
        const uint64_t far_off = i == 1 ? UINT64_MAX : uint64_t{3600} * 1000000000;
        CHECK((take_result(submit(without, pair, 0)) == take_result(submit(with, pair, far_off))));
    }
}
