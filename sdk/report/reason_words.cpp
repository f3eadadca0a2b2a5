// See reason_words.hpp.
#include "sdk/report/reason_words.hpp"

#include <algorithm>

namespace defrec::cli {

const std::vector<StateWord>& state_words() {
    static const std::vector<StateWord> words = {
        {"initialising", "Starting"},   {"tracking", "Tracking"},
        {"degraded", "Less sure"},      {"lost", "Lost"},
        {"relocalised", "Found again"},
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
        {"dark", "a picture is black", "check light, lens and cable"},
        {"saturated", "a picture is white", "check light and distance"},
        {"no-texture", "the pictures show hardly any contrast", "look whether the lens is covered"},
        {"one-view", "one of the two pictures is missing",
         "check lens, cable and input of that view"},
        {"frozen", "the picture stands still", "check the video source"},
        {"views-swapped", "left and right look exchanged", "exchange left and right"},
        {"disparity", "the disparity that was given is not that of the pictures",
         "check the files of --disparity"},
        {"interlaced", "the video is interlaced", "run again with --interlaced"},
        {"view-late", "left and right picture are not of the same time", "synchronise both views"},
        {"calibration", "the calibration does not fit the camera any more",
         "calibrate the cameras again"},
        {"low-contrast", "smoke, blur or a wet lens", "clean the lens, let the smoke clear"},
        {"occluded", "something lies in front of the tissue", "move the instrument aside"},
        {"no-depth", "too little depth is measured", "check focus and distance"},
        {"out-of-view", "much of the tissue is out of the picture", "move the camera back"},
        {"large-residual", "the tissue changed its shape beyond what is modelled",
         "where it lasts, take a new template"},
        {"contradicted", "some of the tissue does not look as expected", ""},
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

std::vector<std::string_view> reason_names(std::string_view reasons) {
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

std::string_view remedy_of(std::string_view reason, std::string_view state) {
    const ReasonWords* known = words_of(reason);
    if (known == nullptr || (reason == "few-matches" && state != "lost")) return {};
    return known->remedy;
}

std::vector<std::string> reasons_in_words(std::string_view reasons) {
    std::vector<std::string> result;
    for (const std::string_view name : reason_names(reasons)) {
        const ReasonWords* known = words_of(name);
        result.emplace_back(known == nullptr ? name : known->words);
    }
    return result;
}

}  // namespace defrec::cli
