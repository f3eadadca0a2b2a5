// The state as the live view shows it: "degraded" as ShownState says it may come and go with each
// heartbeat, too short to be read, so it comes and goes with some delay; states in which positions
// are not to be used come at once. And pictures that come after an outage were found again.
#pragma once

#include <deque>
#include <optional>
#include <string>

namespace defrec::cli {

// After which time without a frame a source has stopped: slow ones have the time that they need.
class OutageLimit {
  public:
    static constexpr double kLeastMs = 1000;
    static constexpr double kIntervals = 3;  // usual ones
    // Until enough intervals are known.
    static constexpr double kFirstMs = 3000;

    void add(double interval_ms);
    double ms() const;

  private:
    std::deque<double> intervals_;  // the last ones
};

class SteadyState {
  public:
    // All times are those of the pictures. Frames that are "degraded" add up to kOnMs before that
    // is shown, and count anew after kOffMs without one; then it is shown no more.
    static constexpr double kOnMs = 500;
    static constexpr double kOffMs = 1000;
    static constexpr double kResumedMs = 5000;  // as ShownState::kFoundMs

    // said: the frame's, as ShownState says it. found: as ShownState has it after that. is_unseen:
    // nothing of the tissue is seen, which is told at once. Returns what is shown.
    std::string take(const std::string& said, const std::string& found, double timestamp_ms,
                     bool is_unseen);
    // Time without a picture before that frame where that was an outage; else 0.
    double gap_ms() const { return gap_ms_; }
    // Whether pictures came again a moment ago, after an outage or having stood still.
    bool is_resumed() const { return resumed_at_ms_.has_value(); }
    // Whether "degraded" is shown, which the frame itself is not.
    bool is_held() const { return is_held_; }

  private:
    // Returns the time since the frame before.
    double note_time(double timestamp_ms);
    bool note_resumed(const std::string& said, double timestamp_ms);
    bool is_less_sure(bool is_degraded, double timestamp_ms, double interval_ms, bool is_unseen);

    OutageLimit limit_;
    std::optional<double> last_ms_, resumed_at_ms_, doubted_at_ms_;
    double gap_ms_ = 0, doubted_ms_ = 0;
    bool stood_still_ = false, was_good_ = false, was_less_sure_ = false, is_held_ = false;
};

}  // namespace defrec::cli
