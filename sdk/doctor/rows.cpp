// Whether a piece of tissue lies in the same row of both rectified views.
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <string>

#include "include/defrec_c.h"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/row_error.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorViews;

// Step of the rows at the middle, px, and its growth along x and y: offset, roll, and what the
// focal lengths differ by.
Eigen::Vector3d fit_rows(const std::vector<RectifiedMatch>& matches) {
    Eigen::Vector3d fit = Eigen::Vector3d::Zero();
    for (const double width : Decision::kTukeyWidths) {
        Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
        Eigen::Vector3d right = Eigen::Vector3d::Zero();
        for (const RectifiedMatch& match : matches) {
            const Eigen::Vector3d row(1, match.x, match.y);
            const double residual = (match.row_step - row.dot(fit)) / width;
            if (std::abs(residual) >= 1) continue;
            const double root = 1 - residual * residual;
            normal += root * root * row * row.transpose();
            right += root * root * match.row_step * row;
        }
        fit = normal.ldlt().solve(right);
    }
    return fit;
}

}  // namespace

Finding look_at_rows(const Evidence& evidence) {
    if (!evidence.has_depth())
        return Look("rows", "rows", Severity::kError)
            .unknown("the views do not fit the calibration");
    const Eigen::Vector3d fit = fit_rows(evidence.as_given().matches);
    const double error = row_error(fit[0], fit[1], fit[2], evidence.width, evidence.height);
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
    return look.found(
        text + ": the right view is " + format_fixed(std::abs(fit[0]), 1) + " px too " +
            (fit[0] > 0 ? "low" : "high") + ", turned " +
            (fit[1] > 0 ? "clockwise by " : "anticlockwise by ") +
            format_fixed(std::abs(kDegrees * fit[1]), 2) + " degrees, and " +
            format_fixed(std::abs(100 * fit[2]), 2) + " % too " +
            (fit[2] > 0 ? "large." : "small.") +
            (is_bad ? " Most of the surface has no depth."
                    : " Frames are tracked, degraded, and expected errors grow.") +
            (is_told ? " The tracker says so of " + of_frames(told, all) + "." : ""),
        std::string("Calibrate anew, at this zoom and focus. ") + kSelfCalibrationHelp);
}

}  // namespace defrec::cli
