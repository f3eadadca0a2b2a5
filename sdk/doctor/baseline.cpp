// Whether the baseline is one of an instrument for the depth that it gives.
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/lengths.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {

Finding look_at_baseline(const Evidence& evidence) {
    using Decision = decisions::DoctorLengths;
    Look look("baseline", "baseline for the depth", Severity::kError);
    const double baseline = baseline_of(evidence.calibration), depth = depth_of(evidence);
    if (depth == 0) return look.unknown("the depth of the tissue is not known");
    const double ratio = baseline / depth;
    look.measured(depth, "mm");
    const std::string text = "with a baseline of " + format_fixed(baseline, 2) +
                             " mm the tissue is " + format_fixed(depth, 0) + " mm away";
    if (are_plausible(baseline, depth) && ratio >= Decision::kMinRatio &&
        ratio <= Decision::kMaxRatio)
        return look.fine(text);
    return look.found(
        text + ". Stereo endoscopes and microscopes have a baseline of " +
            format_fixed(Decision::kMinBaseline, 0) + " to " +
            format_fixed(Decision::kMaxBaseline, 0) + " mm and work at " +
            format_fixed(Decision::kMinDepth, 0) + " to " + format_fixed(Decision::kMaxDepth, 0) +
            " mm, " + format_fixed(1 / Decision::kMaxRatio, 0) + " to " +
            format_fixed(1 / Decision::kMinRatio, 0) + " baselines.",
        "Check that the calibration is of these cameras and of this zoom, and that the size of the "
        "board's squares was given in mm.");
}

}  // namespace defrec::cli
