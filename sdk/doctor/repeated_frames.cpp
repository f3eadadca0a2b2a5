// See repeated_frames.hpp.
#include "sdk/doctor/repeated_frames.hpp"

#include <utility>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"
#include "sdk/input/view_image.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorRepeats;

cv::Mat some_rows(const ImageView& view) {
    const cv::Mat image = mat_of(view);
    cv::Mat rows;
    for (int y = 0; y < image.rows; y += Decision::kRows) rows.push_back(image.row(y));
    return rows;
}

bool repeats(const ImageView& view, cv::Mat& before) {
    const cv::Mat last = std::exchange(before, some_rows(view));
    if (last.empty()) return false;
    const auto values = static_cast<double>(last.total()) * last.channels();
    return cv::norm(last, before, cv::NORM_L1) <= Decision::kMaxDifference * values;
}

// Tissue may stand still for a frame, and a recorder of more frames than the camera gives repeats
// both views now and then.
std::vector<RepeatedFrame> faults_in(const std::vector<RepeatedFrame>& frames) {
    std::vector<RepeatedFrame> faults;
    for (std::size_t i = 0, end = 0; i < frames.size(); i = end) {
        const RepeatedFrame& first = frames[i];
        end = i + 1;
        while (end < frames.size() && frames[end].number == frames[end - 1].number + 1 &&
               frames[end].left == first.left && frames[end].right == first.right)
            ++end;
        if (end - i >= (first.left && first.right ? Decision::kMinRun : Decision::kMinRunOfOne))
            faults.insert(faults.end(), frames.begin() + static_cast<std::ptrdiff_t>(i),
                          frames.begin() + static_cast<std::ptrdiff_t>(end));
    }
    return faults;
}

// "the right view repeats the one before"; "a view" where that differs.
std::string what_repeats(const std::vector<RepeatedFrame>& frames) {
    return phrase_of(frames,
                     {"both views repeat those before, and the tissue is not seen",
                      "the left view repeats the one before, and depth is wrong",
                      "the right view repeats the one before, and depth is wrong",
                      "a view repeats the one before, and depth may be wrong"},
                     [](const RepeatedFrame& frame, bool is_left) {
                         return is_left ? frame.left : frame.right;
                     });
}

}  // namespace

RepeatedFrame RepeatMeter::add(const StereoFrame& frame) {
    return {frame.index, repeats(frame.left, left_), repeats(frame.right, right_)};
}

Finding look_at_repeated_frames(const Evidence& evidence) {
    const std::vector<RepeatedFrame> faults = faults_in(evidence.repeated_frames);
    const bool are_most = evidence.are_most(faults.size());
    Look look("repeated_frames", "repeated frames",
              are_most ? Severity::kError : Severity::kWarning);
    look.measured(static_cast<double>(faults.size()), "frames");
    if (faults.empty()) return look.fine("no view stands still");
    const std::string what =
        "in " + of_frames(faults.size(), evidence.frame_count) + " " + what_repeats(faults);
    const std::string check = "Check camera, cable and recorder of what stands still. ";
    if (are_most)
        return look.found(
            what + ".",
            check + "Record anew, unless other frames are better: --frames looks at them.");
    std::vector<std::int64_t> numbers;
    for (const RepeatedFrame& frame : faults) numbers.push_back(frame.number);
    return look.found(what + ": " + frame_ranges(numbers) + ".",
                      check +
                          "In a recording, leave these frames in, and do not rely on what is said "
                          "of them.");
}

}  // namespace defrec::cli
