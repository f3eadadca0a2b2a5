// See session_notes.hpp.
#include "sdk/session/session_notes.hpp"

#include "include/defrec_c.h"
#include "sdk/io/interrupt.hpp"

namespace defrec::cli {
namespace {

struct ReasonNote {
    std::uint32_t reason;
    const char* text;
};
constexpr ReasonNote kReasonNotes[] = {
    {DEFREC_REASON_VIEWS_SWAPPED, "The two images look swapped; exchange --left and --right."},
    {DEFREC_REASON_VIEW_LATE,
     "In some frames left and right view were taken at different times; see "
     "view_lag_frames in frames.csv."},
    {DEFREC_REASON_INTERLACED,
     "In some frames the rows of an image are of two times, as those of interlaced "
     "video; choose a progressive mode of the camera, or deinterlace."},
    {DEFREC_REASON_CALIBRATION,
     "The calibration has drifted; calibrate anew, or set self_calibration: correct in "
     "--config. See rig_estimate in summary.json."},
};

}  // namespace

void SessionNotes::add_late_template(std::int64_t frame, bool has_targets) {
    const std::string number = std::to_string(frame);
    add("The first frame could not give a template; it was taken from frame " + number +
        ", and the points to follow were looked up there.");
    if (has_targets)
        add("The targets were taken to be given in the left rectified camera of frame " + number +
            ", the template's.");
}

void SessionNotes::conclude(const PointFollower& points, bool has_template) {
    if (const std::size_t count = points.points_without_surface(); count > 0)
        add(std::to_string(count) + " of " + std::to_string(points.count()) +
            " points to follow lie where the template has no surface; they are lost in every "
            "frame.");
    if (!has_template) add("No frame could give a template; nothing was tracked.");
    for (const auto& [reason, text] : kReasonNotes)
        if ((reasons_ & reason) != 0) add(text);
    if (interrupt_requested()) add("Interrupted; the outputs hold the frames tracked until then.");
}

}  // namespace defrec::cli
