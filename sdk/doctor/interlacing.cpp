// Whether the rows of an image are of two times.
#include "include/defrec_c.h"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {

Finding look_at_interlacing(const Evidence& evidence) {
    Look look("interlacing", "interlacing", Severity::kError);
    const std::size_t all = evidence.probe.frames.size();
    const std::size_t count = evidence.probe.frames_with(DEFREC_REASON_INTERLACED);
    const double share = static_cast<double>(count) / static_cast<double>(all);
    look.measured(100 * share, "%");
    if (share <= decisions::DoctorImages::kReasonShare)
        return look.fine("rows beside each other are of one time");
    return look.found("the video is interlaced: in " + of_frames(count, all) +
                          " rows beside each other are of two times.",
                      "Choose a progressive mode of the camera or the capture card, or deinterlace "
                      "the recording, with one field as a frame of half the height or with a "
                      "filter such as FFmpeg's bwdif.");
}

}  // namespace defrec::cli
