// Whether the surface is followed through the frames, and what stands against it.
#include <algorithm>
#include <cctype>
#include <string_view>

#include "include/defrec_c.h"
#include "sdk/client/library.hpp"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"
#include "sdk/report/reason_words.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorFollowed;

struct Cause {
    const ReasonWords* words;
    std::size_t frames;
};

// The first of a frame's reasons against which something helps.
const ReasonWords& main_reason(std::uint32_t reasons) {
    const std::string names = reason_names(reasons, "|");
    for (const ToldReason& told : told_reasons(names, {}))
        if (const ReasonWords* words = words_of(told.name);
            words != nullptr && !words->remedy.empty())
            return *words;
    return *words_of("few-matches");
}

// The causes of most frames first.
std::vector<Cause> causes_of(const std::vector<TrackedFrame>& frames) {
    std::vector<Cause> causes;
    for (const TrackedFrame& frame : frames) {
        const ReasonWords& words = main_reason(frame.reasons);
        const auto known = std::find_if(causes.begin(), causes.end(),
                                        [&](const Cause& each) { return each.words == &words; });
        if (known == causes.end())
            causes.push_back({&words, 1});
        else
            ++known->frames;
    }
    std::stable_sort(causes.begin(), causes.end(),
                     [](const Cause& a, const Cause& b) { return a.frames > b.frames; });
    return causes;
}

std::string sentence(std::string_view text) {
    std::string made(text);
    made.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(made.front())));
    return made + ". ";
}

}  // namespace

Finding look_at_followed(const Evidence& evidence) {
    std::vector<TrackedFrame> missed;
    std::size_t lit = 0;
    for (const TrackedFrame& frame : evidence.probe.frames) {
        if (!frame.is_lit()) continue;
        ++lit;
        if (frame.state == DEFREC_LOST || frame.state == DEFREC_INITIALISING)
            missed.push_back(frame);
    }
    const double share =
        static_cast<double>(missed.size()) / static_cast<double>(std::max<std::size_t>(lit, 1));
    Look look("followed", "following",
              share > Decision::kMostMissed ? Severity::kError : Severity::kWarning);
    if (!evidence.probe.has_rig) return look.unknown("it shows once the calibration is right");
    if (lit == 0) return look.unknown("the frames show nothing");
    look.measured(100 * share, "%");
    if (share <= Decision::kMaxMissed)
        return look.fine("the surface was followed in " + of_frames(lit - missed.size(), lit));
    std::string why, remedy;
    for (const auto& [words, frames] : causes_of(missed)) {
        why += (why.empty() ? "" : "; ") + std::string(words->words) + " (" +
               std::to_string(frames) + ")";
        remedy += sentence(words->remedy);
    }
    const bool is_lost = std::any_of(missed.begin(), missed.end(), [](const TrackedFrame& frame) {
        return frame.state == DEFREC_LOST;
    });
    return look.found("in " + of_frames(missed.size(), lit) +
                          (is_lost ? " the surface was lost: " : " there was no template: ") + why +
                          ".",
                      remedy +
                          "The surface is lost as well where frames of the recording are "
                          "left out.");
}

}  // namespace defrec::cli
