// See reason_words.hpp.
#include "sdk/report/reason_words.hpp"

#include <algorithm>

namespace defrec::cli {

const std::vector<std::pair<std::string_view, std::string_view>>& reason_words() {
    static const std::vector<std::pair<std::string_view, std::string_view>> words = {
        {"dark", "a picture is black"},
        {"saturated", "a picture is white"},
        {"no-texture", "the pictures show hardly any contrast"},
        {"few-matches", "little of the tissue is recognised"},
        {"occluded", "something lies in front of the tissue"},
        {"large-residual", "the tissue changed its shape beyond what is modelled"},
        {"fast-motion", "fast motion"},
        {"out-of-view", "much of the tissue is out of the picture"},
        {"no-depth", "too little depth is measured"},
        {"one-view", "one of the two pictures is missing"},
        {"frozen", "the picture stands still"},
        {"gap", "frames are missing"},
        {"views-swapped", "left and right look exchanged"},
        {"low-contrast", "smoke, blur or a wet lens"},
        {"view-late", "left and right picture are not of the same time"},
        {"calibration", "the calibration does not fit the camera any more"},
        {"template-grew", "tissue came into view and joined"},
        {"template-full", "no further tissue can join"},
        {"coarse", "not enough time to refine"},
        {"unchecked", "not enough time to check"},
        {"overdue", "too slow for its deadline"},
        {"cut", "the tissue came apart"},
        {"piece-lost", "a part of the tissue is not found"},
        {"interlaced", "the video is interlaced"},
        {"contradicted", "some of the tissue does not look as expected"},
    };
    return words;
}

std::vector<std::string> reasons_in_words(std::string_view names) {
    std::vector<std::string> result;
    while (!names.empty()) {
        const std::size_t end = std::min(names.find(','), names.size());
        const std::string_view name = names.substr(0, end);
        names.remove_prefix(std::min(end + 1, names.size()));
        names.remove_prefix(std::min(names.find_first_not_of(' '), names.size()));
        const auto& words = reason_words();
        const auto found = std::find_if(words.begin(), words.end(),
                                        [&](const auto& item) { return item.first == name; });
        result.emplace_back(found == words.end() ? name : found->second);
    }
    return result;
}

}  // namespace defrec::cli
