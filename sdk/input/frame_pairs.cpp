// Pairs of images of two cameras, formed by their times.
#include "sdk/input/frame_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace defrec::cli {

void FramePairs::add(View view, CameraImage image) {
    auto& own = waiting_[view == View::kLeft ? 0 : 1];
    auto& other = waiting_[view == View::kLeft ? 1 : 0];
    const auto difference = [&](const CameraImage& partner) {
        return std::abs(partner.time_ms - image.time_ms);
    };
    const auto partner = std::min_element(
        other.begin(), other.end(),
        [&](const auto& a, const auto& b) { return difference(a) < difference(b); });
    if (partner == other.end() || difference(*partner) > tolerance_ms_) {
        own.push_back(std::move(image));
        if (own.size() > most_waiting_) {
            own.pop_front();
            ++counts_.unpaired;
        }
        return;
    }
    counts_.difference_sum_ms += difference(*partner);
    CameraPair pair = view == View::kLeft ? CameraPair{std::move(image), std::move(*partner)}
                                          : CameraPair{std::move(*partner), std::move(image)};
    // What is older than the pair has missed its partner.
    counts_.unpaired += partner - other.begin() + static_cast<std::int64_t>(own.size());
    other.erase(other.begin(), partner + 1);
    own.clear();
    add_pair(std::move(pair));
}

void FramePairs::add_pair(CameraPair pair) {
    ++counts_.pairs;
    if (newest_) ++counts_.dropped;
    newest_ = std::move(pair);
}

std::optional<CameraPair> FramePairs::take() { return std::exchange(newest_, std::nullopt); }

void FramePairs::end() {
    for (auto& images : waiting_) {
        counts_.unpaired += static_cast<std::int64_t>(images.size());
        images.clear();
    }
}

void FramePairs::clear() {
    for (auto& images : waiting_) images.clear();
    newest_.reset();
}

}  // namespace defrec::cli
