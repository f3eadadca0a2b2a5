// Memory that runs out while a body is made. Replaces operator new for the whole process.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <atomic>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_operator_new.hpp"
#include "sdk/testing/test_session.hpp"

namespace {

std::atomic<long> countdown{-1};  // allocations until one fails; negative: none does

}  // namespace

bool defrec::test::allocation_fails() {
    if (countdown.load(std::memory_order_relaxed) < 0) return false;
    return countdown.fetch_sub(1) == 0;
}

using namespace defrec::test;

TEST_CASE(
    "row 138: memory runs out while a body is made: there is none, and points move as before") {
    TrackingSession session("cpu", 2, [](defrec_rig_desc&, defrec_tracker_desc& desc) {
        desc.body = DEFREC_BODY_OFF;  // until it is asked for
    });
    defrec_job job = nullptr;
    for (int i = 0; i < 2; ++i) {
        defrec_job_release(job);
        const Pair pair = render(0.4 * i, -0.2 * i);
        REQUIRE_OK(session.submit({{pair.left.data()}, {pair.right.data()}, {}}, &job));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
    }
    defrec_template surface = nullptr;
    REQUIRE_OK(defrec_job_get_template(job, &surface));
    const auto body_state = [&] {
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        return result.body;
    };
    const auto moved = [&] {
        const double deep[3] = {0, 0, kDepth + 12};
        Eigen::Vector3d xyz;
        REQUIRE_OK(defrec_job_warp_points(job, deep, 1, xyz.data(), nullptr, nullptr));
        return xyz;
    };
    const Eigen::Vector3d before = moved();
    CHECK(before.allFinite());
    long kept = 0, failures = 0;
    for (const long n : {0L, 1L, 2L, 3L, 5L, 8L, 12L, 20L, 40L, 100L, 300L, 1000L, 3000L}) {
        CAPTURE(n);
        countdown = n;
        // On this thread or on the body's own.
        defrec_status status = defrec_template_set_body(surface, nullptr);
        if (status == DEFREC_OK) status = defrec_template_wait_body(surface, UINT64_MAX);
        const bool reached = countdown < 0;
        countdown = -1;
        REQUIRE(reached);
        CHECK(status == DEFREC_ERROR_OUT_OF_MEMORY);
        CHECK(contains(defrec_last_error(), "memory"));
        CHECK(body_state() == DEFREC_BODY_STATE_NONE);
        CHECK(moved() == before);
        // What is kept is the request.
        if (++failures == 1) kept = live;
        CHECK(live <= kept + 20);
    }
    REQUIRE_OK(defrec_template_set_body(surface, nullptr));
    REQUIRE_OK(defrec_template_wait_body(surface, UINT64_MAX));
    CHECK(body_state() == DEFREC_BODY_STATE_READY);
    CHECK((moved() - before).norm() < 0.5);
    CHECK(live > kept + 20);
    defrec_job_release(job);
    defrec_template_release(surface);
}
