// Whether left is left: of the images, and of the cameras in the calibration.
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorOrder;

}  // namespace

Finding look_at_order(const Evidence& evidence) {
    Look look("order", "order of the views", Severity::kError);
    if (!evidence.has_trials()) return look.unknown("views and calibration cannot be compared");
    const RigTrial& given = evidence.as_given();
    const bool right_is_right = evidence.calibration.translation[0] < 0;
    look.measured(100 * given.front_share, "%");
    const std::string front =
        percent(given.front_share) + " of what both views see lies in front of the cameras";
    if (right_is_right && given.front_share <= Decision::kMaxFront)
        return look.found("the views look exchanged: " + front + ".",
                          "Give the recording of --left as --right, and that of --right as --left; "
                          "with --stereo choose the other half or layout.");
    if (!right_is_right && given.front_share >= Decision::kMinFront)
        return look.found(
            "the first camera of the calibration is the right one, and the images "
            "are named likewise: " +
                front + ", and T points to the right.",
            "Exchange --left with --right, and in the calibration M1, D1 with M2, "
            "D2, and give R and T of the way back: R transposed, and -R^T T.");
    const RigTrial& exchanged = evidence.without(Mistake::kCamerasExchanged);
    const RigTrial& turned = evidence.without(Mistake::kRotationTurned);
    if (right_is_right && given.row_error_px > Decision::kMinRowError &&
        exchanged.front_share >= Decision::kMinFront &&
        exchanged.row_error_px < turned.row_error_px &&
        exchanged.row_error_px < Decision::kBetter * given.row_error_px)
        return look.found("the two cameras of the calibration look exchanged: rows differ by " +
                              format_fixed(given.row_error_px, 2) + " px, and by " +
                              format_fixed(exchanged.row_error_px, 2) +
                              " px with M1, D1 as M2, D2.",
                          "Exchange M1, D1 with M2, D2.");
    return look.fine(front);
}

}  // namespace defrec::cli
