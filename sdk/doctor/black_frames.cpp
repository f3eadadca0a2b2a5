// Which frames show nothing.
#include <algorithm>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

// "frames 20 to 22, 30"; of many ranges the first ones.
std::string ranges_of(const std::vector<BlackFrame>& frames) {
    std::string text = frames.size() == 1 ? "frame " : "frames ";
    std::size_t ranges = 0;
    for (std::size_t i = 0; i < frames.size();) {
        std::size_t end = i + 1;
        while (end < frames.size() && frames[end].number == frames[end - 1].number + 1) ++end;
        if (ranges == decisions::DoctorImages::kNamedRanges) return text + " ...";
        if (ranges++ > 0) text += ", ";
        text += std::to_string(frames[i].number);
        if (end > i + 1) text += " to " + std::to_string(frames[end - 1].number);
        i = end;
    }
    return text;
}

// What is black in all of them; "a view" where that differs.
std::string what_is_black(const std::vector<BlackFrame>& frames) {
    const auto all = [&](bool left, bool right) {
        return std::all_of(frames.begin(), frames.end(), [&](const BlackFrame& each) {
            return each.left == left && each.right == right;
        });
    };
    return all(true, true)    ? "both views are black, and nothing is tracked"
           : all(true, false) ? "the left view is black, and nothing is tracked"
           : all(false, true) ? "the right view is black, and no depth is measured"
                              : "a view is black, and nothing or less is tracked";
}

std::string remedy_for(const std::vector<BlackFrame>& black, std::int64_t first_frame) {
    const std::string after = "--frames " + std::to_string(black.back().number + 1) + ":";
    return black.front().number == first_frame
               ? "Check light, shutter and cable. Of a recording, begin behind them by " + after
               : "Check light, shutter and cable. In a recording, leave them in: the surface is "
                 "found again after them. Where it is not, track what comes after by " +
                     after + ", with points chosen in those frames";
}

}  // namespace

Finding look_at_black_frames(const Evidence& evidence) {
    Look look("black_frames", "black frames", Severity::kWarning);
    const std::vector<BlackFrame>& black = evidence.black_frames;
    look.measured(static_cast<double>(black.size()), "frames");
    if (black.empty()) return look.fine("in no frame is a view black");
    if (black.size() == evidence.frame_count)
        return look.unknown("in all frames looked at a view is black");
    return look.found("in " + of_frames(black.size(), evidence.frame_count) + " " +
                          what_is_black(black) + ": " + ranges_of(black) + ".",
                      remedy_for(black, evidence.first_frame));
}

}  // namespace defrec::cli
