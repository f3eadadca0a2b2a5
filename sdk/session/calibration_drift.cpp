// See calibration_drift.hpp.
#include "sdk/session/calibration_drift.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/row_error.hpp"
#include "sdk/doctor/sentence.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {

void CalibrationDrift::add(const StereoFrame& frame, const defrec_result& result) {
    row_errors_ +=
        row_error(result.vertical_offset_px, std::tan(result.roll_deg * std::numbers::pi / 180),
                  result.focal_ratio - 1, frame.left.width, frame.left.height);
    ++frames_;
}

double CalibrationDrift::mean_row_error() const { return row_errors_ / std::max(frames_, 1); }

bool CalibrationDrift::is_mild() const { return only_degrades(mean_row_error()); }

std::string CalibrationDrift::note(int frames, bool may_correct) const {
    if (frames_ == 0) return {};
    const bool has_rows = mean_row_error() > decisions::DoctorViews::kToldRowError;
    const std::string rows =
        "rows of the two views differ by " + format_fixed(mean_row_error(), 2) + " px";
    if (frames < decisions::DoctorSample::kMinFrames && has_rows)
        return (frames == 1 ? "In its only frame "
                            : "In " +
                                  of_frames(static_cast<std::size_t>(frames_),
                                            static_cast<std::size_t>(frames)) +
                                  " ") +
               rows +
               ": the calibration may have drifted, or the views are of different times, which "
               "more frames tell.";
    std::string text = "The calibration has drifted: in " + std::to_string(frames_) +
                       (frames_ == 1 ? " frame " : " frames ");
    text +=
        has_rows ? rows : "the right view has slipped or turned sideways, and lengths are wrong";
    text += is_mild() ? "; they are degraded, and expected errors grow. " : ". ";
    text += "Calibrate anew, at this zoom and focus. ";
    if (may_correct) text += std::string(kSelfCalibrationHelp) + " ";
    return text + "See rig_estimate in summary.json.";
}

}  // namespace defrec::cli
