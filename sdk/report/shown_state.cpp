// See shown_state.hpp.
#include "sdk/report/shown_state.hpp"

#include <cmath>

namespace defrec::cli {
namespace {

bool is_named(const std::string& reasons, const char* name) {
    return reasons.find(name) != std::string::npos;
}

bool is_followed(const std::string& said) {
    return said == "tracking" || said == "degraded" || said == "found" || said == "relocalised";
}

bool is_lost(const std::string& said) {
    return said == "lost" || said == "unfound" || said == "given-up";
}

}  // namespace

std::string ShownState::take(const std::string& state, const std::string& reasons,
                             double timestamp_ms, const Support& support) {
    std::string said = state_of_tissue(state, timestamp_ms);
    // Pictures that stay black do not move either; where nothing is followed, that is why.
    const bool is_black = (is_named(reasons, "dark") || is_named(reasons, "saturated")) &&
                          !is_named(reasons, "one-view");
    const bool is_unseen_in_black = is_black && (is_lost(said) || said == "initialising");
    if (stands_still(reasons, timestamp_ms) && !is_unseen_in_black) return "stalled";
    if (!is_followed(said)) {
        unmeasured_from_ms_.reset();
        return said;
    }
    if (is_unusable(reasons, timestamp_ms, support)) return "unusable";
    return is_too_large(support.largest_error.value_or(0)) ? "degraded" : said;
}

bool ShownState::is_too_large(double error_mm) {
    return std::round(error_mm * 10) / 10 > kMostErrorMm;
}

bool ShownState::is_unusable(const std::string& reasons, double timestamp_ms,
                             const Support& support) {
    // A repeated picture tells nothing new.
    if (is_named(reasons, "frozen") && !is_named(reasons, "one-view"))
        return unmeasured_from_ms_ && timestamp_ms - *unmeasured_from_ms_ >= kUnmeasuredMs;
    if (!(support.seen_share < kLeastSeen) && !is_too_large(support.least_error.value_or(0))) {
        unmeasured_from_ms_.reset();
        return false;
    }
    if (!unmeasured_from_ms_ || timestamp_ms < *unmeasured_from_ms_)
        unmeasured_from_ms_ = timestamp_ms;
    return timestamp_ms - *unmeasured_from_ms_ >= kUnmeasuredMs;
}

std::string ShownState::state_of_tissue(const std::string& state, double timestamp_ms) {
    if (state == "relocalised") {
        found_ = was_followed_ ? "relocalised" : "found";
        found_at_ms_ = timestamp_ms;
        was_followed_ = true;
        return found_;
    }
    if (state == "tracking" || state == "degraded") {
        was_followed_ = true;
        const double since_ms = timestamp_ms - found_at_ms_;
        if (!(since_ms >= 0 && since_ms < kFoundMs)) found_.clear();
        return found_.empty() || state == "degraded" ? state : found_;
    }
    found_.clear();
    if (state == "initialising" && was_followed_) {
        is_given_up_ = true;
        return "given-up";
    }
    return state == "lost" && !was_followed_ ? "unfound" : state;
}

bool ShownState::stands_still(const std::string& reasons, double timestamp_ms) {
    if (!is_named(reasons, "frozen")) {
        frozen_from_ms_.reset();
        return false;
    }
    if (!frozen_from_ms_ || timestamp_ms < *frozen_from_ms_) frozen_from_ms_ = timestamp_ms;
    return timestamp_ms - *frozen_from_ms_ >= kFrozenMs;
}

std::string reasons_of(const std::string& said, const std::string& reasons,
                       const Support& support) {
    if (said != "degraded" || !ShownState::is_too_large(support.largest_error.value_or(0)))
        return reasons;
    return reasons + (reasons.empty() ? "" : ", ") + kPointErrorReason;
}

}  // namespace defrec::cli
