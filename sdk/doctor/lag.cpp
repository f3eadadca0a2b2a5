// Whether the views are of one time.
#include <cmath>

#include "include/defrec_c.h"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"
#include "sdk/io/statistics.hpp"

namespace defrec::cli {

Finding look_at_lag(const Evidence& evidence) {
    using Decision = decisions::DoctorViews;
    Look look("lag", "lag", Severity::kError);
    if (!evidence.probe.has_rig)
        return look.unknown("it is measured once the calibration is right");
    const std::size_t all = evidence.probe.frames.size();
    std::vector<double> lags;
    std::size_t followed = 0, measured = 0;
    for (const TrackedFrame& frame : evidence.probe.frames) {
        followed += frame.state == DEFREC_TRACKING || frame.state == DEFREC_DEGRADED;
        measured += frame.has_rows;
        if ((frame.reasons & DEFREC_REASON_VIEW_LATE) != 0) lags.push_back(frame.view_lag_frames);
    }
    if (followed < 2) return look.unknown("the tissue could not be followed");
    if (lags.empty() && measured == 0)
        return look.unknown("the tracker did not measure the rows of both views");
    const double lag = nearest_rank(lags, 0.5);
    look.measured(lag, "frames");
    if (static_cast<double>(lags.size()) < Decision::kLateShare * static_cast<double>(all) ||
        std::abs(lag) < Decision::kMinLag)
        return look.fine("no lag of a view shows");
    return look.found("in " + of_frames(lags.size(), all) + " the right view is " +
                          format_fixed(std::abs(lag), 1) + " frames " +
                          (lag > 0 ? "late" : "early") + ".",
                      "Trigger both cameras together, or pair the views by their times; in a "
                      "recording, leave out frames of the view that is early.");
}

}  // namespace defrec::cli
