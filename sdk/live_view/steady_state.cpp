// See steady_state.hpp.
#include "sdk/live_view/steady_state.hpp"

#include <algorithm>
#include <vector>

namespace defrec::cli {
namespace {

constexpr std::size_t kIntervalsKept = 9, kIntervalsNeeded = 3;

bool is_good(const std::string& said) {
    return said == "tracking" || said == "found" || said == "relocalised";
}

}  // namespace

void OutageLimit::add(double interval_ms) {
    intervals_.push_back(interval_ms);
    if (intervals_.size() > kIntervalsKept) intervals_.pop_front();
}

double OutageLimit::ms() const {
    if (intervals_.size() < kIntervalsNeeded) return kFirstMs;
    std::vector<double> sorted(intervals_.begin(), intervals_.end());
    std::sort(sorted.begin(), sorted.end());
    return std::max(kLeastMs, kIntervals * sorted[sorted.size() / 2]);
}

std::string SteadyState::take(const std::string& said, const std::string& found,
                              double timestamp_ms, bool is_unseen) {
    const double interval_ms = note_time(timestamp_ms);
    const bool has_resumed = note_resumed(said, timestamp_ms);
    is_held_ = false;
    if (!is_good(said) && said != "degraded") {
        was_good_ = was_less_sure_ = false;
        doubted_at_ms_.reset();
        return said;
    }
    const bool is_degraded = said == "degraded";
    was_less_sure_ = is_less_sure(is_degraded, timestamp_ms, interval_ms, is_unseen);
    was_good_ = !was_less_sure_;
    is_held_ = was_less_sure_ && !is_degraded;
    if (was_less_sure_) return "degraded";
    if (!found.empty()) return found;
    return has_resumed ? "relocalised" : "tracking";
}

double SteadyState::note_time(double timestamp_ms) {
    gap_ms_ = 0;
    if (last_ms_ && timestamp_ms < *last_ms_) *this = SteadyState();  // a recording begins again
    const double interval_ms = last_ms_ ? timestamp_ms - *last_ms_ : 0;
    if (interval_ms > limit_.ms()) gap_ms_ = interval_ms;
    if (last_ms_) limit_.add(interval_ms);
    last_ms_ = timestamp_ms;
    return interval_ms;
}

bool SteadyState::note_resumed(const std::string& said, double timestamp_ms) {
    const bool stands_still = said == "stalled";
    if ((stood_still_ && !stands_still) || gap_ms_ > 0) resumed_at_ms_ = timestamp_ms;
    stood_still_ = stands_still;
    const bool is_followed = is_good(said) || said == "degraded" || said == "unusable";
    if (!is_followed || (resumed_at_ms_ && timestamp_ms - *resumed_at_ms_ >= kResumedMs))
        resumed_at_ms_.reset();
    return resumed_at_ms_.has_value();
}

bool SteadyState::is_less_sure(bool is_degraded, double timestamp_ms, double interval_ms,
                               bool is_unseen) {
    const bool is_recent = doubted_at_ms_ && timestamp_ms - *doubted_at_ms_ < kOffMs;
    if (!is_degraded) return was_less_sure_ && is_recent;
    doubted_ms_ = (is_recent ? doubted_ms_ : 0) + interval_ms;
    doubted_at_ms_ = timestamp_ms;
    // A state that was worse gives way to nothing better than what the frame is.
    return was_less_sure_ || !was_good_ || is_unseen || doubted_ms_ >= kOnMs;
}

}  // namespace defrec::cli
