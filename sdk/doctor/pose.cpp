// Whether R and T lead from the left camera to the right one.
#include <algorithm>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorOrder;

constexpr const char* kWanted =
    " In OpenCV's stereo YAML, a point x of the left camera is R x + T in the right one.";

const char* remedy_of(Mistake mistake) {
    switch (mistake) {
        case Mistake::kPoseInverted:
            return "Replace R by R transposed, and T by -R^T T.";
        case Mistake::kTranslationTurned:
            return "Change the sign of all three numbers of T.";
        default:
            return "Replace R by R transposed; MATLAB writes it so.";
    }
}

}  // namespace

Finding look_at_pose(const Evidence& evidence) {
    Look look("pose", "direction of R and T", Severity::kError);
    if (!evidence.has_trials()) return look.unknown("views and calibration cannot be compared");
    const RigTrial& given = evidence.as_given();
    look.measured(given.row_error_px, "px");
    const bool right_is_right = evidence.calibration.translation[0] < 0;
    const bool is_behind = given.front_share <= Decision::kMaxFront;
    const auto better = [&](std::initializer_list<Mistake> mistakes) -> const RigTrial& {
        return evidence.without(
            *std::min_element(mistakes.begin(), mistakes.end(), [&](Mistake a, Mistake b) {
                return evidence.without(a).row_error_px < evidence.without(b).row_error_px;
            }));
    };
    if (!right_is_right && is_behind) {
        const RigTrial& best = better({Mistake::kPoseInverted, Mistake::kTranslationTurned});
        return look.found(
            "R and T have the wrong direction: by T the second camera lies to the "
            "left of the first, and all tissue behind them.",
            std::string(remedy_of(best.mistake)) + kWanted);
    }
    const RigTrial& turned = evidence.without(Mistake::kRotationTurned);
    if (right_is_right && !is_behind && given.row_error_px > Decision::kMinRowError &&
        turned.front_share >= Decision::kMinFront &&
        turned.row_error_px < Decision::kBetter * given.row_error_px)
        return look.found("R has the wrong direction: rows differ by " +
                              format_fixed(given.row_error_px, 2) + " px, and by " +
                              format_fixed(turned.row_error_px, 2) + " px with R transposed.",
                          std::string(remedy_of(turned.mistake)) + kWanted);
    if (!evidence.has_depth()) return look.unknown("the views do not fit the calibration");
    return look.fine("rows agree best with R and T as they are given");
}

}  // namespace defrec::cli
