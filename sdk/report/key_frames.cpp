// Keeps the pictures few.
#include "sdk/report/key_frames.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace defrec::cli {
namespace {

/// The change that lies nearest after the one before it: its loss costs least.
std::size_t max_crowded(const std::vector<KeyFrame>& changes) {
    std::size_t result = 1;
    for (std::size_t i = 2; i < changes.size(); ++i)
        if (changes[i].frame - changes[i - 1].frame <
            changes[result].frame - changes[result - 1].frame)
            result = i;
    return result;
}

}  // namespace

bool KeyFrames::wants(std::int64_t frame, const std::string& state) {
    as_change_ = any_ && state != last_state_;
    any_ = true;
    last_state_ = state;
    const bool even = even_.offer();
    if (as_change_ && changes_.size() == kChanges) {
        // Painting and encoding a picture that would be the one to go is not worth it.
        const std::size_t crowded = max_crowded(changes_);
        as_change_ =
            frame - changes_.back().frame > changes_[crowded].frame - changes_[crowded - 1].frame;
    }
    return as_change_ || even;
}

void KeyFrames::add(KeyFrame picture) {
    picture.state_changed = as_change_;
    if (!as_change_) {
        even_.keep(std::move(picture));
        return;
    }
    changes_.push_back(std::move(picture));
    if (changes_.size() > kChanges)
        changes_.erase(changes_.begin() + static_cast<std::ptrdiff_t>(max_crowded(changes_)));
}

std::vector<KeyFrame> KeyFrames::sorted() const {
    std::vector<KeyFrame> all = changes_;
    const auto crowding = static_cast<std::int64_t>(even_.stride() / 4);
    for (const KeyFrame& even : even_.items())
        if (even.frame == even_.items().front().frame ||
            std::none_of(changes_.begin(), changes_.end(), [&](const KeyFrame& change) {
                return std::abs(change.frame - even.frame) <= crowding;
            }))
            all.push_back(even);
    std::sort(all.begin(), all.end(),
              [](const KeyFrame& a, const KeyFrame& b) { return a.frame < b.frame; });
    return all;
}

}  // namespace defrec::cli
