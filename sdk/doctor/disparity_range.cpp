// Whether stereo searches the disparities that the tissue has.
#include <algorithm>
#include <cmath>

#include "include/defrec_c.h"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {

Finding look_at_disparity_range(const Evidence& evidence) {
    using Decision = decisions::DoctorViews;
    Look look("disparity_range", "disparity range", Severity::kError);
    const TrackProbe& probe = evidence.probe;
    if (!probe.has_rig || !evidence.has_depth())
        return look.unknown("it is measured once the calibration is right");
    if (probe.least_disparity > probe.largest_disparity)
        return look.unknown("stereo found no disparity");
    std::size_t near = 0, far = 0;
    const auto& matches = evidence.as_given().matches;
    for (const RectifiedMatch& match : matches) {
        const double disparity = probe.camera.fx * probe.camera.baseline_mm / match.depth_mm -
                                 probe.camera.disparity_offset_px;
        near += disparity > probe.largest_disparity + Decision::kBeyond;
        far += disparity < probe.least_disparity - Decision::kBeyond;
    }
    const double all = static_cast<double>(matches.size()),
                 share = static_cast<double>(std::max(near, far)) / all;
    look.measured(100 * share, "%");
    if (share <= Decision::kMaxOutside)
        return look.fine("stereo finds disparities of " + format_fixed(probe.least_disparity, 0) +
                         " to " + format_fixed(probe.largest_disparity, 0) + " px");
    return look.found(
        percent(share) + " of what both views see is " + (near > far ? "nearer" : "farther") +
            " than the disparities that stereo searches, of which it finds " +
            format_fixed(probe.least_disparity, 0) + " to " +
            format_fixed(probe.largest_disparity, 0) + " px.",
        near > far
            ? "Take disparities, min_disparity and min_depth_mm out of --config; without them, "
              "move back, or resize images and calibration to half."
            : "Take disparities and min_disparity out of --config; without them, converge the "
              "views on the tissue.");
}

}  // namespace defrec::cli
