// What frames tell of the rig is committed once, or dropped.
#include "sdk/tracking/monitors/rig_monitor.hpp"

#include <doctest/doctest.h>

#include "include/defrec_c.h"

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 640, kHeight = 480;

// The right view lies that much lower everywhere.
std::vector<RowMatch> shifted_rows(double px) {
    std::vector<RowMatch> matches;
    for (int x = -300; x <= 300; x += 30)
        for (int y = -220; y <= 220; y += 40)
            matches.push_back({static_cast<double>(x), static_cast<double>(y), px, 0});
    return matches;
}

// The state after a frame with these matches.
RigState after(const RigMonitor& watch, const std::vector<RowMatch>& matches) {
    RigState next = watch.state();
    next.left = next.monitor.update(matches);
    next.rows = {1, 2};
    return next;
}

RigMonitor watch_of(uint32_t self_calibration) { return {kWidth, kHeight, self_calibration}; }

}  // namespace

TEST_CASE("a state that is not committed changes nothing") {
    RigMonitor watch = watch_of(DEFREC_SELF_CALIBRATION_CORRECT);
    for (int frame = 0; frame < 10; ++frame) {
        watch.begin_frame();
        after(watch, shifted_rows(1));
    }
    CHECK(watch.reasons() == 0);
    CHECK(watch.state().rows.empty());
    CHECK_FALSE(watch.due_correction());
}

TEST_CASE("rows that disagree are a reason, and corrected where that is asked for") {
    RigMonitor watch = watch_of(DEFREC_SELF_CALIBRATION_CORRECT);
    for (int frame = 0; frame < 10; ++frame) {
        watch.begin_frame();
        RigState next = after(watch, shifted_rows(1));
        watch.commit(next, RigMonitor::Disparities::kSayNothing);
    }
    CHECK(watch.reasons() == DEFREC_REASON_CALIBRATION);
    CHECK(watch.estimate().vertical_offset_px == doctest::Approx(1).epsilon(0.05));
    const std::optional<Rig::ViewShift> shift = watch.due_correction();
    REQUIRE(shift);
    CHECK(shift->offset_px == doctest::Approx(1).epsilon(0.05));
    watch.correct(*shift);
    CHECK(watch.reasons() == 0);
    CHECK_FALSE(watch.due_correction());

    RigMonitor other = watch_of(DEFREC_SELF_CALIBRATION_REPORT);
    for (int frame = 0; frame < 10; ++frame) {
        other.begin_frame();
        RigState next = after(other, shifted_rows(1));
        other.commit(next, RigMonitor::Disparities::kSayNothing);
    }
    CHECK(other.reasons() == DEFREC_REASON_CALIBRATION);
    CHECK_FALSE(other.due_correction());
}

TEST_CASE("a frame that says nothing leaves no rows for the next") {
    RigMonitor watch = watch_of(DEFREC_SELF_CALIBRATION_REPORT);
    RigState next = after(watch, shifted_rows(0));
    watch.commit(next, RigMonitor::Disparities::kSayNothing);
    CHECK(watch.state().rows == std::vector<float>{1, 2});
    watch.skip_frame();
    CHECK(watch.state().rows.empty());
}
