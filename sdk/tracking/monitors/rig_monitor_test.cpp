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

// Tissue 80 mm from the camera, whose disparities are larger by so many px.
constexpr double kFocal = 600, kBaseline = 5;
TemplateData surface() {
    TemplateData data;
    data.camera = {kFocal, kFocal, 0, 0, kBaseline, 0};
    data.grid.spacing = 15;
    data.width = kWidth;
    for (int i = 0; i < 40 * 30; ++i) {
        defrec_surface_point point{};
        point.position[0] = static_cast<float>(1.5 * (i % 40 - 20));
        point.position[1] = static_cast<float>(1.5 * (i / 40 - 15));
        point.position[2] = static_cast<float>(80 + 5 * std::sin(0.3 * i));
        data.vertices.push_back(point);
    }
    return data;
}
std::vector<defrec_surface_sample> seen(const TemplateData& data, double larger_px) {
    std::vector<defrec_surface_sample> samples;
    for (const defrec_surface_point& vertex : data.vertices) {
        const double z = vertex.position[2],
                     nearer = 1 / (1 + larger_px * z / (kFocal * kBaseline));
        defrec_surface_sample sample{};
        for (int axis = 0; axis < 3; ++axis)
            sample.position[axis] = static_cast<float>(vertex.position[axis] * nearer);
        sample.observation = DEFREC_OBSERVED;
        samples.push_back(sample);
    }
    return samples;
}
void commit_seen(RigMonitor& monitor, const TemplateData& data, double larger_px) {
    monitor.begin_frame();
    RigState next = after(monitor, shifted_rows(0));
    next.disparities.add_frame(data, seen(data, larger_px));
    monitor.commit(next, RigMonitor::Disparities::kCount);
}

// Tissue that moves along the rows.
std::vector<RowMatch> moving_along(double px) {
    std::vector<RowMatch> matches = shifted_rows(0);
    for (RowMatch& match : matches) {
        match.along = px;
        match.growth = 0;
    }
    return matches;
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

TEST_CASE("a frame that is skipped twice is one frame") {
    const TemplateData data = surface();
    RigMonitor monitor = monitor_of(DEFREC_SELF_CALIBRATION_REPORT);
    for (int frame = 0; frame < 3; ++frame) commit_seen(monitor, data, 0);
    for (int frame = 0; frame < 6; ++frame) {
        monitor.begin_frame();
        monitor.skip_frame();
        monitor.skip_frame();
    }
    // Less than BaselineDrift::kOldest frames ago it was another.
    commit_seen(monitor, data, 20);
    CHECK(monitor.state().disparities.baseline_drift_px() == doctest::Approx(20).epsilon(0.1));
}

TEST_CASE("what a correction does to disparities is no drift of the baseline") {
    constexpr double kTurn = 0.01;
    const TemplateData data = surface();
    RigMonitor monitor = monitor_of(DEFREC_SELF_CALIBRATION_CORRECT);
    for (int frame = 0; frame < 5; ++frame) commit_seen(monitor, data, 0);
    CHECK(monitor.state().patches.size() == 1);
    monitor.correct({.vergence = kTurn});
    CHECK(monitor.state().patches.empty());
    for (int frame = 0; frame < 3; ++frame) {
        commit_seen(monitor, data, kFocal * kTurn);
        CHECK(monitor.state().disparities.baseline_drift_px() == 0);
        CHECK(monitor.reasons() == 0);
    }
}

TEST_CASE("frames that say nothing keep what a correction leaves, and what depth last erred by") {
    RigMonitor monitor = monitor_of(DEFREC_SELF_CALIBRATION_CORRECT);
    for (int frame = 0; frame < 2; ++frame) {
        monitor.begin_frame();
        CHECK(monitor.state().left.last_depth_px == 0);
        RigState next = after(monitor, moving_along(3));
        monitor.commit(next, RigMonitor::Disparities::kSayNothing);
    }
    const double unseen = double{monitor.state().left.unseen_lag_frames};
    CHECK(unseen > 0);
    monitor.end_depth();
    monitor.correct({.vergence = 0.01});
    CHECK(monitor.state().left.corrected_sigma == 0);  // of the frame before it
    for (int frame = 0; frame < 3; ++frame) {
        monitor.begin_frame();
        CHECK(monitor.state().left.last_depth_px == doctest::Approx(3 * unseen).epsilon(0.01));
        CHECK(monitor.state().left.corrected_sigma > 0);
        monitor.skip_frame();
    }
}
