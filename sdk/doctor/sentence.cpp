// Numbers in sentences.
#include "sdk/doctor/sentence.hpp"

#include "sdk/doctor/decisions.hpp"

namespace defrec::cli {

std::string percent(double share) { return format_fixed(100 * share, 0).append(" %"); }

std::string of_frames(std::size_t count, std::size_t all) {
    return std::to_string(count).append(" of ").append(std::to_string(all)).append(" frames");
}

std::string frame_ranges(const std::vector<std::int64_t>& frames) {
    std::string text = frames.size() == 1 ? "frame " : "frames ";
    std::size_t ranges = 0;
    for (std::size_t i = 0; i < frames.size();) {
        std::size_t end = i + 1;
        while (end < frames.size() && frames[end] == frames[end - 1] + 1) ++end;
        if (ranges == decisions::DoctorImages::kNamedRanges) return text + " ...";
        if (ranges++ > 0) text += ", ";
        text += std::to_string(frames[i]);
        if (end > i + 1) text += " to " + std::to_string(frames[end - 1]);
        i = end;
    }
    return text;
}

}  // namespace defrec::cli
