// See told_state.hpp.
#include "sdk/report/told_state.hpp"

#include <algorithm>

namespace defrec::cli {
namespace {

Support support_of(const FrameRecord& frame) {
    Support support{frame.observed_share, {}, {}};
    for (const PointEstimate& point : frame.points) {
        if (!point.is_chosen || point.status == VertexStatus::unknown) continue;
        const auto error = static_cast<double>(expected_error(point));
        support.least_error = std::min(support.least_error.value_or(error), error);
        support.largest_error = std::max(support.largest_error.value_or(error), error);
    }
    return support;
}

}  // namespace

std::string ToldState::take(const FrameRecord& frame) {
    std::string told =
        shown_.take(frame.state, frame.reasons, frame.timestamp_ms, support_of(frame));
    if (told != "unusable") return told;
    // As unusableInWords() of the live view.
    if (!(frame.observed_share < ShownState::kLeastSeen)) return "large-errors";
    const bool is_one_view = frame.reasons.find("one-view") != std::string::npos ||
                             frame.faulty_views == "left" || frame.faulty_views == "right";
    return is_one_view ? "one-view" : "unseen";
}

std::string reasons_told(const FrameRecord& frame, const std::string& told) {
    return reasons_of(told, frame.reasons, support_of(frame));
}

Doubt doubt_of(std::string_view state) {
    if (state == "lost" || state == "unfound" || state == "given-up") return Doubt::lost;
    if (state == "stalled") return Doubt::frozen;
    if (state == "one-view" || state == "unseen" || state == "large-errors") return Doubt::unusable;
    return state == "degraded" ? Doubt::degraded : Doubt::none;
}

}  // namespace defrec::cli
