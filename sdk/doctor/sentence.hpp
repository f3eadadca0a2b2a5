// Numbers in sentences.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/io/text.hpp"

namespace defrec::cli {

std::string percent(double share);
std::string of_frames(std::size_t count, std::size_t all);
// The phrase for the views that are at fault in all of some frames; differ: not in the same ones.
struct ViewPhrases {
    std::string both, left, right, differ;
};
// is_at_fault(frame, is_left): whether that view is.
template <class Frames, class IsAtFault>
std::string phrase_of(const Frames& frames, const ViewPhrases& phrases,
                      const IsAtFault& is_at_fault) {
    const auto all = [&](bool left, bool right) {
        return std::all_of(frames.begin(), frames.end(), [&](const auto& each) {
            return is_at_fault(each, true) == left && is_at_fault(each, false) == right;
        });
    };
    return all(true, true)    ? phrases.both
           : all(true, false) ? phrases.left
           : all(false, true) ? phrases.right
                              : phrases.differ;
}
// "frames 20 to 22, 30" of ascending ones; of many ranges the first ones.
std::string frame_ranges(const std::vector<std::int64_t>& frames);

}  // namespace defrec::cli
