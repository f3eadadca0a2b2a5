// Whether the rows of an image are of two times.
#include "include/defrec_c.h"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

const char* fields_of(FieldOrder fields) {
    switch (fields) {
        case FieldOrder::kTopFirst:
            return "the images are interlaced, top field first; each field is a frame";
        case FieldOrder::kBottomFirst:
            return "the images are interlaced, bottom field first; each field is a frame";
        default:
            return "rows beside each other are of one time";
    }
}

}  // namespace

Finding look_at_interlacing(const Evidence& evidence) {
    Look look("interlacing", "interlacing", Severity::kError);
    const std::size_t all = evidence.probe.frames.size();
    const std::size_t count = evidence.probe.frames_with(DEFREC_REASON_INTERLACED);
    const double share = static_cast<double>(count) / static_cast<double>(all);
    const bool is_seen = evidence.probe.frames_with(DEFREC_REASON_DARK | DEFREC_REASON_SATURATED |
                                                    DEFREC_REASON_NO_TEXTURE) < all;
    if (!is_seen && evidence.fields == FieldOrder::kProgressive)
        return look.unknown("the images show nothing by which rows could be compared");
    look.measured(100 * share, "%");
    if (share <= decisions::DoctorImages::kReasonShare)
        return look.fine(fields_of(evidence.fields));
    return look.found("the video is interlaced: in " + of_frames(count, all) +
                          " rows beside each other are of two times.",
                      "Say which field is first, by --interlaced top-first or --interlaced "
                      "bottom-first: each field is then tracked as a frame.");
}

}  // namespace defrec::cli
