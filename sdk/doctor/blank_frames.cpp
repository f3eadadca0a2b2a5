// Which frames show nothing: a view is black, or white.
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

struct Kind {
    BlankFrame::Look look;
    const char *id, *title, *word, *check;
};
constexpr Kind kBlack = {BlankFrame::kBlack, "black_frames", "black frames", "black",
                         "Check light, shutter and cable."};
constexpr Kind kWhite = {BlankFrame::kWhite, "white_frames", "white frames", "white",
                         "Check light, gain and exposure time."};

// In which view all of them are so; "a view" where that differs.
std::string what_is_blank(const std::vector<BlankFrame>& frames, const Kind& kind) {
    const std::string word = kind.word;
    return phrase_of(frames,
                     {"both views are " + word + ", and nothing is tracked",
                      "the left view is " + word + ", and nothing is tracked",
                      "the right view is " + word + ", and no depth is measured",
                      "a view is " + word + ", and nothing or less is tracked"},
                     [&](const BlankFrame& frame, bool is_left) {
                         return (is_left ? frame.left : frame.right) == kind.look;
                     });
}

std::string remedy_for(const std::vector<std::int64_t>& blank, const Evidence& evidence) {
    const auto behind = [](std::int64_t frame) {
        return "--frames " + std::to_string(frame + 1) + ":";
    };
    if (blank.front() == evidence.first_frame) {
        std::size_t end = 1;
        while (end < blank.size() && blank[end] == blank[end - 1] + 1) ++end;
        return " Of a recording, begin behind them by " + behind(blank[end - 1]);
    }
    if (blank.back() == evidence.last_frame) return {};
    return " In a recording, leave them in: the surface is found again after them. Where it is "
           "not, track what comes after by " +
           behind(blank.back()) + ", with points chosen in those frames";
}

Finding look_at(const Evidence& evidence, const Kind& kind) {
    std::vector<BlankFrame> frames;
    std::vector<std::int64_t> numbers;
    for (const BlankFrame& frame : evidence.blank_frames) {
        if (!frame.is(kind.look)) continue;
        frames.push_back(frame);
        numbers.push_back(frame.number);
    }
    Look look(kind.id, kind.title,
              evidence.are_most(frames.size()) ? Severity::kError : Severity::kWarning);
    look.measured(static_cast<double>(frames.size()), "frames");
    const std::string word = kind.word;
    if (frames.empty()) return look.fine("in no frame is a view " + word);
    if (frames.size() == evidence.frame_count)
        return look.unknown("in all frames looked at a view is " + word);
    return look.found("in " + of_frames(frames.size(), evidence.frame_count) + " " +
                          what_is_blank(frames, kind) + ": " + frame_ranges(numbers) + ".",
                      kind.check + remedy_for(numbers, evidence));
}

}  // namespace

Finding look_at_black_frames(const Evidence& evidence) { return look_at(evidence, kBlack); }

Finding look_at_white_frames(const Evidence& evidence) { return look_at(evidence, kWhite); }

}  // namespace defrec::cli
