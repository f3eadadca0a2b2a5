// Points beneath a surface that errs as a whole.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "sdk/testing/plane_tracker.hpp"

using namespace defrec::test;

namespace {

struct Errors {
    double surface, deep;  // expected, mm
};
Errors errors_of(defrec_job job) {
    const double points[6] = {0, 0, kDepth, 0, 0, kDepth + 10};
    double moved[6], expected[2];
    REQUIRE_OK(defrec_job_warp_points(job, points, 2, moved, nullptr, expected));
    return {expected[0], expected[1]};
}
uint32_t reasons_of(defrec_job job) {
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(job, &result));
    return result.reasons;
}
defrec_job track(PlaneTracker& tracker, const Pair& pair) {
    defrec_job job = nullptr;
    REQUIRE_OK(tracker.submit(pair, &job));
    REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
    return job;
}

}  // namespace

TEST_CASE("row 106: a baseline that drifts moves what lies beneath as it moves the surface") {
    constexpr int kSlip = 2;  // px
    for (const uint32_t body : {DEFREC_BODY_ON, DEFREC_BODY_OFF}) {
        CAPTURE(body);
        PlaneTracker tracker(body);
        if (body == DEFREC_BODY_ON)
            REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
        // Up and down, so that rows tell that no view is late.
        const auto at = [](int time) { return 1.2 * std::sin(0.5 * time); };
        for (int i = 1; i < 12; ++i) defrec_job_release(tracker.track(0, at(i)));
        defrec_job job = tracker.track(0, at(12));
        const Errors sound = errors_of(job);
        CHECK(reasons_of(job) == 0);
        CHECK(sound.deep < 1);
        defrec_job_release(job);
        Pair pair = render(0, at(13));
        std::memmove(pair.right.data(), pair.right.data() + kSlip, pair.right.size() - kSlip);
        job = track(tracker, pair);
        CHECK((reasons_of(job) & DEFREC_REASON_CALIBRATION) != 0);
        const Errors slipped = errors_of(job);
        const double shared =
            std::sqrt(slipped.surface * slipped.surface - sound.surface * sound.surface);
        CHECK(shared > 3);
        CHECK(slipped.deep > 0.9 * shared);
        CHECK(slipped.deep < 2 * slipped.surface);
        defrec_job_release(job);
    }
}

TEST_CASE("what a frame without depth leaves open at the surface it leaves open beneath") {
    PlaneTracker tracker;
    REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
    for (int i = 1; i < 8; ++i) defrec_job_release(tracker.track(0, 1.2 * std::sin(0.5 * i)));
    Pair pair = render(0, 0);
    pair.right.assign(pair.right.size(), 0);
    defrec_job job = track(tracker, pair);
    CHECK((reasons_of(job) & DEFREC_REASON_ONE_VIEW) != 0);
    const Errors errors = errors_of(job);
    CHECK(errors.surface > 1);
    CHECK(errors.deep > 0.9 * errors.surface);
    defrec_job_release(job);
}
