// Whether left is left: of the images, and of the cameras in the calibration.
#include <algorithm>
#include <vector>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"
#include "sdk/io/statistics.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorOrder;

// The ends of what matches say, but for mismatches.
double least_of(const std::vector<double>& values) {
    return nearest_rank(values, Decision::kOutliers);
}
double most_of(const std::vector<double>& values) {
    return nearest_rank(values, 1 - Decision::kOutliers);
}

constexpr char kShifted[] =
    "see whether one view was cropped or shifted to the side, as players of 3D video do, and "
    "whether the calibration is of these cameras and of images as these are, rectified or not.";

// Depths of the tissue, mm, if the images are exchanged; none: it does not lie in front then.
std::vector<double> depths_if_exchanged(const Evidence& evidence) {
    const RigTrial& exchanged = evidence.without(Mistake::kImagesExchanged);
    std::vector<double> depths;
    if (exchanged.front_share < Decision::kMinFront) return depths;
    for (const RectifiedMatch& match : exchanged.matches)
        if (match.depth_mm > 0) depths.push_back(match.depth_mm);
    return depths;
}

// A view that is shifted by more than all disparities looks like that as well, but for the depth.
Finding found_exchanged(Look& look, const std::string& front, const std::vector<double>& depths) {
    return look.found(
        "the views look exchanged: " + front + "; with left and right exchanged the tissue lies " +
            format_fixed(least_of(depths), 0) + " to " + format_fixed(most_of(depths), 0) +
            " mm away.",
        std::string("If that may be so, give the recording of --left as --right, and that of "
                    "--right as --left. ") +
            kHalvesExchanged + " If the tissue was elsewhere, the disparities are shifted: " +
            kShifted + " Images that are mirrored from side to side are to be mirrored back.");
}

// Rows agree, and no mistake in the calibration explains where the tissue lies.
bool is_shifted(const Evidence& evidence) {
    if (evidence.as_given().row_error_px > Decision::kMinRowError) return false;
    return std::none_of(evidence.trials.begin(), evidence.trials.end(), [](const RigTrial& trial) {
        return trial.front_share >= Decision::kMinFront &&
               trial.row_error_px <= Decision::kMinRowError;
    });
}

Finding found_shifted(Look& look, const std::string& front, const RigTrial& given) {
    std::vector<double> disparities;
    for (const RectifiedMatch& match : given.matches) disparities.push_back(match.disparity);
    return look.found(
        "rows agree, but only " + front + ": disparities are shifted, they run from " +
            format_fixed(least_of(disparities), 0) + " to " +
            format_fixed(most_of(disparities), 0) + " px, and no exchange of the views mends that.",
        std::string("S") + (kShifted + 1));
}

}  // namespace

Finding look_at_order(const Evidence& evidence) {
    Look look("order", "order of the views", Severity::kError);
    if (!evidence.has_trials()) return look.unknown("views and calibration cannot be compared");
    const RigTrial& given = evidence.as_given();
    const bool right_is_right = evidence.calibration.translation[0] < 0;
    look.measured(100 * given.front_share, "%");
    const std::string front =
        percent(given.front_share) + " of what both views see lies in front of the cameras";
    const std::vector<double> depths = depths_if_exchanged(evidence);
    if (right_is_right && given.front_share <= Decision::kMaxFront && !depths.empty())
        return found_exchanged(look, front, depths);
    if (right_is_right && is_shifted(evidence)) return found_shifted(look, front, given);
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
