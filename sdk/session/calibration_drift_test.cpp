// What is said of rows that differ, and when it is no more than a warning.
#include "sdk/session/calibration_drift.hpp"

#include <doctest/doctest.h>

#include "sdk/client/library.hpp"

using namespace defrec::cli;

namespace {

CalibrationDrift drift_of(float offset) {
    StereoFrame frame;
    frame.left.width = 640;
    frame.left.height = 360;
    auto result = initialised<defrec_result>();
    result.reasons = DEFREC_REASON_CALIBRATION;
    result.vertical_offset_px = offset;
    result.focal_ratio = 1;
    CalibrationDrift drift;
    for (int i = 0; i < 4; ++i) drift.add(frame, result);
    return drift;
}

bool says(const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("rows that only degrade frames are a warning of the run, as they are of the doctor") {
    const CalibrationDrift mild = drift_of(-0.5f);
    CHECK(mild.is_mild());
    CHECK(
        says(mild.note(40, true), "in 4 frames rows of the two views differ by 0.50 px; they are"));
    CHECK_FALSE(drift_of(0.7f).is_mild());
    // The right view slipped sideways, which rows do not show.
    CHECK_FALSE(drift_of(0).is_mild());
    CHECK(says(drift_of(0).note(40, true), "in 4 frames the right view has slipped"));
    CHECK(CalibrationDrift().note(40, true).empty());
}

TEST_CASE("a run that corrects the calibration is not advised to") {
    CHECK(says(drift_of(0.5f).note(40, true), "self_calibration: correct in --config"));
    const std::string corrected = drift_of(0.5f).note(40, false);
    CHECK_FALSE(says(corrected, "self_calibration"));
    CHECK(says(corrected, "Calibrate anew"));
}

TEST_CASE("of a few frames with rows that differ no drift is told: a late view looks alike") {
    CHECK(drift_of(2).note(1, true).find("In its only frame rows of the two views differ") == 0);
    CHECK(drift_of(2).note(6, true).find("In 4 of 6 frames rows of the two views differ") == 0);
    CHECK_FALSE(says(drift_of(2).note(6, true), "Calibrate anew"));
    CHECK(says(drift_of(2).note(12, true), "Calibrate anew"));
}
