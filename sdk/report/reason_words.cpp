// See reason_words.hpp.
#include "sdk/report/reason_words.hpp"

#include <algorithm>
#include <utility>

namespace defrec::cli {
namespace {

constexpr std::string_view kOfThatInput = "check that video input";

std::vector<std::string_view> sorted_names(std::string_view reasons) {
    std::vector<std::string_view> names;
    while (!reasons.empty()) {
        const std::size_t end = std::min(reasons.find_first_of(",| "), reasons.size());
        if (end > 0) names.push_back(reasons.substr(0, end));
        reasons.remove_prefix(std::min(end + 1, reasons.size()));
    }
    const auto rank = [](std::string_view name) {
        const ReasonWords* known = words_of(name);
        return known == nullptr ? reason_words().size()
                                : static_cast<std::size_t>(known - reason_words().data());
    };
    std::stable_sort(names.begin(), names.end(),
                     [&](std::string_view a, std::string_view b) { return rank(a) < rank(b); });
    return names;
}

bool has(const std::vector<std::string_view>& names, std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

// A picture that is black or white has no contrast, is missing, and does not move.
bool follows_from_others(std::string_view name, const std::vector<std::string_view>& names) {
    if (!has(names, "dark") && !has(names, "saturated")) return false;
    return name == "no-texture" || name == "one-view" ||
           (name == "frozen" && !has(names, "one-view"));
}

// Which picture a reason speaks of: "left", "right", "both"; empty: not known.
std::string_view picture_of(std::string_view name, const std::vector<std::string_view>& names,
                            std::string_view faulty_views) {
    if (name == "frozen" && has(names, "one-view"))
        return faulty_views == "left" ? "right" : faulty_views == "right" ? "left" : "";
    if (name == "view-late" && has(names, "frozen")) return {};
    const bool is_either = faulty_views == "both" && has(names, "dark") && has(names, "saturated");
    return is_either ? std::string_view() : faulty_views;
}

ToldReason told_of(const ReasonWords& reason, std::string_view picture) {
    const bool is_blank = reason.name == "dark" || reason.name == "saturated";
    if (is_blank && picture == "both")
        return {reason.name, "both pictures are" + std::string(reason.of_one.substr(2)),
                reason.remedy};
    if (reason.of_one.empty() || (picture != "left" && picture != "right"))
        return {reason.name, std::string(reason.words), reason.remedy};
    const bool stands_still = reason.name == "frozen" || reason.name == "view-late";
    return {reason.name, "the " + std::string(picture) + " picture " + std::string(reason.of_one),
            stands_still ? kOfThatInput : words_of("one-view")->remedy};
}

}  // namespace

const std::vector<StateWord>& state_words() {
    static const std::vector<StateWord> words = {
        {"initialising", "Starting"},   {"tracking", "Tracking"},
        {"degraded", "Less sure"},      {"lost", "Lost"},
        {"relocalised", "Found again"}, {"found", "Found"},
        {"unfound", "Not found yet"},   {"given-up", "Lost"},
        {"stalled", "No new picture"},  {"one-view", "One view only"},
        {"unseen", "Tissue not seen"},  {"large-errors", "Large errors"},
    };
    return words;
}

std::string_view word_of_state(std::string_view name) {
    const auto& words = state_words();
    const auto found = std::find_if(words.begin(), words.end(),
                                    [&](const StateWord& item) { return item.name == name; });
    return found == words.end() ? name : found->word;
}

const std::vector<ReasonWords>& reason_words() {
    static const std::vector<ReasonWords> words = {
        {"dark", "a picture is black", "check light, lens and cable", "is black"},
        {"saturated", "a picture is white", "check light and distance", "is white"},
        {"no-texture", "the pictures show hardly any contrast", "look whether the lens is covered"},
        {"one-view", "one of the two pictures is missing",
         "check lens, cable and input of that view", "is missing"},
        {"frozen", "the picture stands still", "check the video source", "stands still"},
        {"views-swapped", "left and right look exchanged", "exchange left and right"},
        {"disparity", "the disparity that was given is not that of the pictures",
         "check the files of --disparity"},
        {"interlaced", "the video is interlaced", "run again with --interlaced"},
        {"view-late", "left and right picture are not of the same time", "synchronise both views",
         "stands still"},
        {"calibration", "rows of left and right do not fit the calibration",
         "calibrate again, if both pictures are of one time"},
        {"low-contrast", "smoke, blur, a wet or covered lens",
         "clean the lens, let the smoke clear"},
        {"occluded", "something lies in front of the tissue", "move it aside"},
        {"no-depth", "too little depth is measured",
         "look whether something covers the tissue, check focus and distance"},
        {"out-of-view", "much of the tissue is out of the picture", "move the camera back"},
        {"large-residual", "the tissue changed its shape beyond what is modelled",
         "where it lasts, take a new template"},
        {"point-error", "a chosen point has an expected error above 3 mm", ""},
        {"contradicted", "some of the tissue does not look as expected",
         "look whether something lies on it"},
        {"cut", "the tissue came apart", ""},
        {"piece-lost", "a part of the tissue is not found", ""},
        {"few-matches", "little of the tissue is recognised",
         "move the camera back to where the tissue was last followed"},
        {"fast-motion", "fast motion", "move more slowly"},
        {"gap", "frames are missing", "check the video source"},
        {"overdue", "too slow for its deadline", "use a faster computer or smaller pictures"},
        {"coarse", "not enough time to refine", "use a faster computer or smaller pictures"},
        {"unchecked", "not enough time to check", "use a faster computer or smaller pictures"},
        {"template-grew", "tissue came into view and joined", ""},
        {"template-full", "no further tissue can join", ""},
    };
    return words;
}

const ReasonWords* words_of(std::string_view name) {
    const auto& words = reason_words();
    const auto found = std::find_if(words.begin(), words.end(),
                                    [&](const ReasonWords& item) { return item.name == name; });
    return found == words.end() ? nullptr : &*found;
}

std::vector<ToldReason> told_reasons(std::string_view reasons, std::string_view faulty_views) {
    const std::vector<std::string_view> names = sorted_names(reasons);
    std::vector<ToldReason> told;
    for (const std::string_view name : names) {
        if (follows_from_others(name, names)) continue;
        const ReasonWords* known = words_of(name);
        told.push_back(known == nullptr ? ToldReason{name, std::string(name), {}}
                                        : told_of(*known, picture_of(name, names, faulty_views)));
    }
    return told;
}

std::vector<std::string> reasons_in_words(std::string_view reasons, std::string_view faulty_views) {
    std::vector<std::string> words;
    for (ToldReason& reason : told_reasons(reasons, faulty_views))
        words.push_back(std::move(reason.words));
    return words;
}

std::string_view remedy_of(const ToldReason& reason, std::string_view state) {
    if (reason.name != "few-matches" || state == "lost") return reason.remedy;
    return state == "unfound" ? "see whether it is the tissue of the template" : std::string_view();
}

}  // namespace defrec::cli
