// See frame_shift.hpp.
#include "sdk/evaluation/score/frame_shift.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

#include "sdk/evaluation/score/percentile.hpp"
#include "sdk/io/counted.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr std::int64_t kNoFrame = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kLargestFrame = 1'000'000'000'000'000;  // sums of two are numbers

bool is_usual(std::int64_t frame) { return frame <= kLargestFrame && frame >= -kLargestFrame; }

double median_of(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return percentile(values, 0.5);
}

class ShiftSearch {
  public:
    ShiftSearch(const TrackedPositions& tracked, const TruePositions& truth)
        : tracked_(tracked), truth_(truth) {
        for (const auto& [key, position] : tracked) {
            if (!position || !is_usual(key.frame)) continue;
            first_tracked_ = std::min(first_tracked_, key.frame);
            is_common_ = is_common_ || true_place(key, 0) != nullptr;
        }
        for (const auto& [key, xyz] : truth)
            if (is_usual(key.frame)) first_true_ = std::min(first_true_, key.frame);
        if (first_tracked_ != kNoFrame) first_numbered_mm_ = errors_in(first_tracked_, 0);
    }

    std::optional<FrameShift> best() const {
        if (first_tracked_ == kNoFrame || first_true_ == kNoFrame) return {};
        std::set<std::int64_t> shifts{first_true_ - first_tracked_};
        for (std::int64_t shift = 1; shift <= ShiftLimits::kMaxShift; ++shift)
            shifts.insert({shift, -shift});
        shifts.erase(0);
        std::optional<FrameShift> best;
        for (const std::int64_t shift : shifts) {
            const std::optional<FrameShift> fit = fit_of(shift);
            if (fit && (!best || fit->median_mm < best->median_mm)) best = fit;
        }
        return best;
    }

  private:
    // Null where the truth does not have it, or hides it.
    const Xyz* true_place(const FrameAndId& key, std::int64_t shift) const {
        if (!is_usual(key.frame)) return nullptr;
        const auto found = truth_.find({key.frame + shift, key.id});
        return found != truth_.end() ? &found->second : nullptr;
    }

    std::vector<double> errors_in(std::int64_t frame, std::int64_t shift) const {
        std::vector<double> errors;
        for (const auto& [key, position] : tracked_) {
            if (key.frame != frame || !position) continue;
            if (const Xyz* place = true_place(key, shift))
                errors.push_back(distance(position->xyz, *place));
        }
        return errors;
    }

    // The shift, where it fits clearly better.
    std::optional<FrameShift> fit_of(std::int64_t shift) const {
        std::vector<double> shifted, numbered, in_expected;
        std::set<std::int64_t> frames;
        for (const auto& [key, position] : tracked_) {
            if (!position) continue;
            const Xyz* place = true_place(key, shift);
            const Xyz* as_numbered = true_place(key, 0);
            if (place == nullptr || (is_common_ && as_numbered == nullptr)) continue;
            frames.insert(key.frame);
            shifted.push_back(distance(position->xyz, *place));
            if (as_numbered != nullptr) numbered.push_back(distance(position->xyz, *as_numbered));
            if (position->expected_mm && *position->expected_mm > 0)
                in_expected.push_back(shifted.back() / *position->expected_mm);
        }
        if (shifted.size() < ShiftLimits::kMinPoints || frames.size() < ShiftLimits::kMinFrames)
            return {};
        FrameShift fit{
            shift, shifted.size(), median_of(shifted), {}, shift == first_true_ - first_tracked_};
        if (is_common_) fit.numbered_mm = median_of(numbered);
        // Without a frame in common only the expected errors say what a fit is.
        if (in_expected.empty() ? !is_common_ : median_of(in_expected) > ShiftLimits::kMaxExpected)
            return {};
        if (is_common_ && !(fit.median_mm <= ShiftLimits::kMaxPart * *fit.numbered_mm)) return {};
        if (!fits_first_frame(shift, *frames.begin())) return {};
        return fit;
    }

    bool fits_first_frame(std::int64_t shift, std::int64_t first_compared) const {
        const bool has_first = !errors_in(first_tracked_, shift).empty();
        if (first_numbered_mm_.size() < ShiftLimits::kMinFirstPoints) return has_first;
        const std::vector<double> first =
            errors_in(has_first ? first_tracked_ : first_compared, shift);
        return median_of(first_numbered_mm_) >= ShiftLimits::kMinFirst * median_of(first);
    }

    const TrackedPositions& tracked_;
    const TruePositions& truth_;
    std::int64_t first_tracked_ = kNoFrame, first_true_ = kNoFrame;
    bool is_common_ = false;                 // some frame is, as numbered
    std::vector<double> first_numbered_mm_;  // errors in the first frame, as numbered
};

}  // namespace

std::optional<FrameShift> better_shift(const TrackedPositions& tracked,
                                       const TruePositions& truth) {
    return ShiftSearch(tracked, truth).best();
}

std::string sentence_of(const FrameShift& shift, const std::string& truth,
                        const std::string& noun) {
    const bool is_high = shift.shift > 0;
    std::string text =
        truth + " fits " + (shift.numbered_mm ? "clearly better" : "well") +
        " where its frame numbers are " + std::to_string(is_high ? shift.shift : -shift.shift) +
        (is_high ? " lower" : " higher") + ": the median over " + counted(shift.points, noun) +
        " is then " + format_fixed(shift.median_mm, 3) + " mm";
    if (shift.numbered_mm) text += " instead of " + format_fixed(*shift.numbered_mm, 3) + " mm";
    if (shift.shift == 1 && shift.begins_together) return text + ": are its frames counted from 1?";
    return text +
           ": is it the truth of another part of the recording, or are its frames counted "
           "from another number?";
}

}  // namespace defrec::cli
