// Whether the views are of one time.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/pairings.hpp"
#include "sdk/doctor/sentence.hpp"
#include "sdk/io/statistics.hpp"

namespace defrec::cli {
namespace {

constexpr char kTrigger[] = "With cameras, trigger both together. ";
constexpr char kOfTimes[] =
    "Where both views have times, write the images that belong together into two folders, and "
    "leave out those without a partner; else record anew.";

// The images of the late view are those of earlier times: its first ones have no partner, nor have
// the last ones of the other view.
std::string leave_out(int frames, bool is_right_late) {
    const std::string number = std::to_string(frames);
    const std::string images = frames == 1 ? "image" : number + " images";
    const std::string lasts = frames == 1 ? "the last one" : "the last " + number;
    return "leave out the first " + images + " of the " + (is_right_late ? "right" : "left") +
           " view, the late one, and " + lasts + " of the " + (is_right_late ? "left" : "right") +
           ", so that both have as many; one source with both views has to be cut into two for "
           "that. A note that the numbers in the names differ by " +
           number +
           " is right then; renumber the images to be rid of it. This holds where the lag is the "
           "same from the recording's first frame on.";
}

// The right view's lag, frames.
std::string lag_of(double frames, int decimals) {
    const std::string number = format_fixed(std::abs(frames), decimals);
    return "the right view is " + number + (number == "1" ? " frame " : " frames ") +
           (frames > 0 ? "late" : "early");
}

Finding found_by_pairing(Look look, const Pairing& better, const Evidence& evidence) {
    double given_px = 0;
    for (const Pairing& pairing : evidence.pairings)
        if (pairing.later == 0) given_px = pairing.row_motion_px;
    const int frames = std::abs(better.later);
    const bool is_late = better.later > 0;
    return look.measured(better.later, "frames")
        .found(lag_of(better.later, 0) + ": rows of the two views move against each other by " +
                   format_fixed(given_px, 2) + " px, and by " +
                   format_fixed(better.row_motion_px, 2) +
                   " px where each left image is paired with the right one that stands " +
                   std::to_string(frames) + (frames == 1 ? " frame " : " frames ") +
                   (is_late ? "later." : "earlier."),
               kTrigger + ("In a recording, " + leave_out(frames, is_late)));
}

bool is_whole(double lag) {
    const double whole = std::round(std::abs(lag));
    return whole > 0 && std::abs(std::abs(lag) - whole) <= decisions::DoctorPairings::kWhole;
}

// The finding where neither rows nor the tracker tell by how many frames.
std::string try_frames(double lag) {
    const int least = static_cast<int>(std::floor(std::abs(lag)));
    const std::string either =
        least == 0 ? "1 frame, or part of one"
                   : std::to_string(least) + " or " + std::to_string(least + 1) + " frames";
    return std::string(kTrigger) + "In a recording, the lag may be " + either + ": try " +
           (least == 0 ? "it" : "both") + ", and look again. For " +
           (least == 0 ? "1 frame" : "each number of frames") + ", l" +
           leave_out(std::max(least, 1), lag > 0).substr(1) +
           (least == 0 ? "" : " Then one more of both.") + " Where a lag is found all the same, w" +
           (kOfTimes + 1);
}

// What the tracker measured as a lag. Rows may not tell by how many whole frames: pairings tell
// nothing then, or that none of whole frames is right.
std::string remedy_for(double lag, const Evidence& evidence) {
    if (is_of_no_pairing(evidence.pairings))
        return std::string(kTrigger) +
               "In a recording, leaving out images does not mend it: shifted by up to " +
               std::to_string(decisions::DoctorPairings::kMostFrames) +
               " frames, rows do not agree in all frames: the lag is no whole number of frames, "
               "changes, or is longer. " +
               kOfTimes;
    if (!is_whole(lag)) return try_frames(lag);
    return kTrigger +
           ("In a recording, " + leave_out(static_cast<int>(std::round(std::abs(lag))), lag > 0)) +
           " Where it is not: w" + (kOfTimes + 1);
}

Finding found_by_tracker(Look look, double lag, std::size_t late, const Evidence& evidence) {
    const std::string in_frames = "in " + of_frames(late, evidence.probe.frames.size());
    const Pairing* const likely = likely_pairing(lag, evidence.pairings);
    if (likely == nullptr)
        return look.found(in_frames + " " + lag_of(lag, 1) + ".", remedy_for(lag, evidence));
    const int frames = std::abs(likely->later);
    return look.measured(likely->later, "frames")
        .found(lag_of(likely->later, 0) + ": the tracker finds a lag " + in_frames +
                   ", and rows differ by " + format_fixed(likely->row_error_px, 2) +
                   " px, the least, where each left image is paired with the right one that "
                   "stands " +
                   std::to_string(frames) + (frames == 1 ? " frame " : " frames ") +
                   (lag > 0 ? "later." : "earlier."),
               kTrigger + ("In a recording, " + leave_out(frames, lag > 0)));
}

}  // namespace

Finding look_at_lag(const Evidence& evidence) {
    using Decision = decisions::DoctorViews;
    Look look("lag", "lag", Severity::kError);
    if (!evidence.probe.has_rig)
        return look.unknown("it is measured once the calibration is right");
    if (const Pairing* better = better_pairing(evidence.pairings))
        return found_by_pairing(look, *better, evidence);
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
    return found_by_tracker(look, lag, lags.size(), evidence);
}

}  // namespace defrec::cli
