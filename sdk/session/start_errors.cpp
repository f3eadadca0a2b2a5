// See start_errors.hpp.
#include "sdk/session/start_errors.hpp"

#include <algorithm>
#include <utility>

#include "sdk/base/util/median.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/decisions.hpp"

namespace defrec::cli {
namespace {

using Decisions = decisions::StartErrors;

// 0 where nothing is observed.
double median_of_observed(const defrec_result& result) {
    std::vector<double> errors;
    for (std::uint64_t i = 0; i < result.vertex_count; ++i)
        if (result.vertex_status[i] == DEFREC_POINT_OBSERVED)
            errors.push_back(double{result.expected_error_mm[i]});
    return median(std::move(errors));
}

}  // namespace

void StartErrors::add(std::int64_t frame, const defrec_result& result) {
    // Nothing has to be added where the reasons say why errors are large.
    if (frames_.size() == Decisions::kFrames || result.state != DEFREC_TRACKING ||
        result.reasons != 0)
        return;
    if (const double expected_mm = median_of_observed(result); expected_mm > 0)
        frames_.push_back({frame, expected_mm});
}

std::string StartErrors::note() const {
    if (frames_.empty()) return {};
    const auto less = [](const Frame& a, const Frame& b) { return a.expected_mm < b.expected_mm; };
    const auto largest = std::max_element(frames_.begin(), frames_.end(), less);
    const double usual =
        std::min_element(frames_.begin(), frames_.end(), less)->expected_mm * Decisions::kLarge;
    if (largest->expected_mm < std::max(Decisions::kMinLarge, usual)) return {};
    std::int64_t last = largest->number;
    for (const Frame& frame : frames_)
        if (frame.expected_mm >= std::max(Decisions::kMinLarge, usual)) last = frame.number;
    return "Expected errors are large in some frames up to frame " + std::to_string(last) +
           ", half of them " + format_fixed(largest->expected_mm, 1) + " mm or more in frame " +
           std::to_string(largest->number) +
           ": at the start it cannot be told yet whether the right view is late, until the tissue "
           "has moved enough.";
}

}  // namespace defrec::cli
