// See shown_state.hpp.
#include "sdk/live_view/shown_state.hpp"

namespace defrec::cli {

std::string ShownState::take(const std::string& state, double timestamp_ms) {
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
        return found_.empty() ? state : found_;
    }
    found_.clear();
    return state == "lost" && !was_followed_ ? "unfound" : state;
}

}  // namespace defrec::cli
