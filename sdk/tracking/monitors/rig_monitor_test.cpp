// A frame's measurements of the rig are committed once, or dropped.
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
RigState after(const RigMonitor& monitor, const std::vector<RowMatch>& matches) {
    RigState next = monitor.state();
    next.left = next.monitor.update(matches);
    next.patches = {{1, 2, 3}};
    return next;
}

RigMonitor monitor_of(uint32_t self_calibration) { return {kWidth, kHeight, self_calibration}; }

}  // namespace

TEST_CASE("a state that is not committed changes nothing") {
    RigMonitor monitor = monitor_of(DEFREC_SELF_CALIBRATION_CORRECT);
    for (int frame = 0; frame < 10; ++frame) {
        monitor.begin_frame();
        after(monitor, shifted_rows(1));
    }
    CHECK(monitor.reasons() == 0);
    CHECK(monitor.state().patches.empty());
    CHECK_FALSE(monitor.due_correction());
}

TEST_CASE("rows that disagree are a reason, and corrected where that is asked for") {
    RigMonitor monitor = monitor_of(DEFREC_SELF_CALIBRATION_CORRECT);
    for (int frame = 0; frame < 10; ++frame) {
        monitor.begin_frame();
        RigState next = after(monitor, shifted_rows(1));
        monitor.commit(next, RigMonitor::Disparities::kSayNothing);
    }
    CHECK(monitor.reasons() == DEFREC_REASON_CALIBRATION);
    CHECK(monitor.estimate().vertical_offset_px == doctest::Approx(1).epsilon(0.05));
    const std::optional<Rig::ViewShift> shift = monitor.due_correction();
    REQUIRE(shift);
    CHECK(shift->offset_px == doctest::Approx(1).epsilon(0.05));
    monitor.correct(*shift);
    CHECK(monitor.reasons() == 0);
    CHECK_FALSE(monitor.due_correction());

    RigMonitor other = monitor_of(DEFREC_SELF_CALIBRATION_REPORT);
    for (int frame = 0; frame < 10; ++frame) {
        other.begin_frame();
        RigState next = after(other, shifted_rows(1));
        other.commit(next, RigMonitor::Disparities::kSayNothing);
    }
    CHECK(other.reasons() == DEFREC_REASON_CALIBRATION);
    CHECK_FALSE(other.due_correction());
}

TEST_CASE(
    "row 108: a right view that is turned is a reason, and corrected where that is asked for") {
    constexpr double kFocal = 600, kTurn = 0.01;
    std::vector<RowMatch> matches = shifted_rows(0);
    for (RowMatch& match : matches) {
        match.turn = match.x * match.y / kFocal;
        match.step = kTurn * match.turn;
    }
    RigMonitor monitor = monitor_of(DEFREC_SELF_CALIBRATION_CORRECT);
    for (int frame = 0; frame < 5; ++frame) {
        monitor.begin_frame();
        RigState next = after(monitor, matches);
        monitor.commit(next, RigMonitor::Disparities::kSayNothing);
    }
    CHECK(monitor.reasons() == DEFREC_REASON_CALIBRATION);
    const std::optional<Rig::ViewShift> shift = monitor.due_correction();
    REQUIRE(shift);
    CHECK(shift->vergence == doctest::Approx(kTurn).epsilon(0.02));
    CHECK(std::abs(shift->offset_px) < 0.02);
    monitor.correct(*shift);
    CHECK(monitor.reasons() == 0);
    CHECK(monitor.estimate().vergence == doctest::Approx(kTurn).epsilon(0.02));
    CHECK(monitor.state().left.corrected_sigma == 0);
    RigState next = after(monitor, shifted_rows(0));
    monitor.commit(next, RigMonitor::Disparities::kSayNothing);
    CHECK(monitor.state().left.corrected_sigma > 0);  // whatever the rows say then
}

TEST_CASE("a frame that says nothing leaves no rows for the next") {
    RigMonitor monitor = monitor_of(DEFREC_SELF_CALIBRATION_REPORT);
    RigState next = after(monitor, shifted_rows(0));
    monitor.commit(next, RigMonitor::Disparities::kSayNothing);
    CHECK(monitor.state().patches.size() == 1);
    monitor.skip_frame();
    CHECK(monitor.state().patches.empty());
}
