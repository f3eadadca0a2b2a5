// Whether a piece of tissue lies in the same row of both rectified views.
#include <cmath>
#include <string>

#include "include/defrec_c.h"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/row_error.hpp"
#include "sdk/doctor/row_fit.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorViews;

// Steps that are not the same in all frames are no error of a calibration.
std::string words_on_motion(const std::vector<RectifiedMatch>& matches) {
    const auto [least, most] = range_of_steps(matches);
    if (most - least < Decision::kMovingRows) return {};
    return " From frame to frame they differ by other amounts, from " + format_fixed(least, 1) +
           " to " + format_fixed(most, 1) +
           " px, which no calibration does: the views may be of different times, or one camera "
           "moves against the other.";
}

}  // namespace

Finding look_at_rows(const Evidence& evidence) {
    if (!evidence.has_depth())
        return Look("rows", "rows", Severity::kError)
            .unknown("the views do not fit the calibration");
    const std::vector<RectifiedMatch>& matches = evidence.as_given().matches;
    const RowFit fit = fit_rows(matches);
    const double error =
        row_error(fit.step, fit.along_x, fit.along_y, evidence.width, evidence.height);
    const std::size_t all = evidence.probe.frames.size(),
                      told = evidence.probe.frames_with(DEFREC_REASON_CALIBRATION);
    const bool is_told = static_cast<double>(told) >
                         decisions::DoctorImages::kReasonShare * static_cast<double>(all);
    const bool is_bad = error > Decision::kMaxRowError;
    Look look("rows", "rows", is_bad ? Severity::kError : Severity::kWarning);
    look.measured(error, "px");
    const std::string text =
        "rows of the rectified views differ by " + format_fixed(error, 2) + " px";
    if (error <= Decision::kToldRowError && !is_told) return look.fine(text);
    constexpr double kDegrees = 57.29577951308232;
    const std::string motion = words_on_motion(matches);
    return look.found(
        text + ": the right view is " + format_fixed(std::abs(fit.step), 1) + " px too " +
            (fit.step > 0 ? "low" : "high") + ", turned " +
            (fit.along_x > 0 ? "clockwise by " : "anticlockwise by ") +
            format_fixed(std::abs(kDegrees * fit.along_x), 2) + " degrees, and " +
            format_fixed(std::abs(100 * fit.along_y), 2) + " % too " +
            (fit.along_y > 0 ? "large." : "small.") +
            (is_bad ? " Most of the surface has no depth."
                    : " Frames are tracked, degraded, and expected errors grow.") +
            (is_told ? " The tracker says so of " + of_frames(told, all) + "." : "") + motion,
        motion.empty()
            ? std::string("Calibrate anew, at this zoom and focus. ") + kSelfCalibrationHelp
            : "Trigger both cameras together and see that every image of one view has its partner "
              "of the other; then look again whether the calibration is right.");
}

}  // namespace defrec::cli
