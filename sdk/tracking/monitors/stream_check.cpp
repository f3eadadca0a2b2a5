// See stream_check.hpp.
#include "sdk/tracking/monitors/stream_check.hpp"

#include <algorithm>
#include <utility>

#include "sdk/tracking/decisions/images.hpp"

namespace defrec {
namespace {

using decisions::Images, decisions::FrozenImages;

// Timestamps may lie farther apart than their type can say.
int64_t step_between(int64_t earlier, int64_t later) {
    const uint64_t step = static_cast<uint64_t>(later) - static_cast<uint64_t>(earlier);
    return static_cast<int64_t>(std::min<uint64_t>(step, INT64_MAX));
}

// usual: of the frames before; 0: not known.
int64_t mean_step(int64_t usual, int64_t step) {
    if (usual == 0) return step;
    const int64_t counted = step / Images::kMostSteps >= usual ? Images::kMostSteps * usual : step;
    return usual + (counted - usual) / Images::kStepMemory;
}

bool is_frozen(const ImageStatistics& image, uint64_t last_hash) {
    return image.hash == last_hash || image.frozen >= FrozenImages::kFrozenShare;
}

bool is_flat(const ImageStatistics& image) { return image.deviation < Images::kMinDeviation; }

uint32_t views(bool left, bool right) {
    return (left ? DEFREC_VIEW_LEFT : 0) | (right ? DEFREC_VIEW_RIGHT : 0);
}

uint32_t faulty_views(const StreamCheck::Finding& finding) {
    constexpr uint32_t kOfBoth = DEFREC_REASON_DARK | DEFREC_REASON_SATURATED |
                                 DEFREC_REASON_NO_TEXTURE | DEFREC_REASON_FROZEN;
    const StreamCheck::Finding::View &left = finding.left, &right = finding.right;
    if ((finding.reasons & DEFREC_REASON_ONE_VIEW) != 0) return views(!left.shows, !right.shows);
    if ((finding.reasons & kOfBoth) != 0) return views(true, true);
    return views(left.is_frozen_alone, right.is_frozen_alone);
}

}  // namespace

StreamCheck::Finding StreamCheck::check(int64_t timestamp_ns, const ImageStatistics& left,
                                        const ImageStatistics& right, bool is_bottom) {
    Finding finding;
    uint64_t(&last_hash)[2] = last_hash_[is_bottom ? 1 : 0];
    uint32_t& reasons = finding.reasons;
    finding.left.shows = !left.dark() && !left.saturated();
    finding.right.shows = !right.dark() && !right.saturated();
    if (finding.left.shows && finding.right.shows && is_flat(left) != is_flat(right))
        (is_flat(left) ? finding.left : finding.right).shows = false;
    if (finding.left.shows != finding.right.shows) reasons |= DEFREC_REASON_ONE_VIEW;
    if (left.dark() || right.dark()) reasons |= DEFREC_REASON_DARK;
    if (left.saturated() || right.saturated()) reasons |= DEFREC_REASON_SATURATED;
    if (is_flat(left) && is_flat(right)) reasons |= DEFREC_REASON_NO_TEXTURE;
    if (left.interlaced() || right.interlaced()) reasons |= DEFREC_REASON_INTERLACED;
    if (std::exchange(has_last_, true)) {
        const bool left_is_frozen = is_frozen(left, last_hash[0]),
                   right_is_frozen = is_frozen(right, last_hash[1]),
                   both_show = finding.left.shows && finding.right.shows;
        // Noise of a view that shows nothing is no sign of life.
        const bool left_stands = left_is_frozen || (!finding.left.shows && finding.right.shows),
                   right_stands = right_is_frozen || (!finding.right.shows && finding.left.shows);
        if (left_stands && right_stands) reasons |= DEFREC_REASON_FROZEN;
        if (both_show && left_is_frozen != right_is_frozen &&
            (left_is_frozen ? right : left).frozen < FrozenImages::kMovingShare) {
            reasons |= DEFREC_REASON_VIEW_LATE;
            (left_is_frozen ? finding.left : finding.right).is_frozen_alone = true;
        }
        const int64_t step = step_between(last_timestamp_, timestamp_ns);
        if (usual_step_ > 0 && step - usual_step_ > usual_step_) reasons |= DEFREC_REASON_GAP;
        usual_step_ = mean_step(usual_step_, step);
    }
    finding.faulty_views = faulty_views(finding);
    last_hash[0] = left.hash;
    last_hash[1] = right.hash;
    last_timestamp_ = timestamp_ns;
    return finding;
}

}  // namespace defrec
