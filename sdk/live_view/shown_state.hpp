// The state as the page says it. Tissue that is found again is said to be so for some seconds,
// since a single frame is not seen; what was never followed was not lost, as at the start of a run
// with --from-template; what was followed is lost where its template is given up; and what a video
// shows that stands still is not of now.
#pragma once

#include <optional>
#include <string>

namespace defrec::cli {

class ShownState {
  public:
    // Time of the pictures for which "found" or "relocalised" is said, in place of tracking.
    static constexpr double kFoundMs = 5000;
    // Time of the pictures for which they stand still before "stalled" is said: single ones are
    // repeated where a source of 25 frames/s is sent at 30.
    static constexpr double kFrozenMs = 500;

    // state, reasons: the tracker's, of one frame after the other. Returns the state, or what is
    // said in its place, "found", "unfound", "given-up" and "stalled" among that.
    std::string take(const std::string& state, const std::string& reasons, double timestamp_ms);
    // "found" or "relocalised" in that time, also of a frame that is degraded; else empty.
    const std::string& found() const { return found_; }
    // Whether a template was given up: targets and plan belong to the first one.
    bool is_given_up() const { return is_given_up_; }

  private:
    std::string state_of_tissue(const std::string& state, double timestamp_ms);
    bool stands_still(const std::string& reasons, double timestamp_ms);

    bool was_followed_ = false, is_given_up_ = false;
    std::string found_;
    double found_at_ms_ = 0;
    std::optional<double> frozen_from_ms_;
};

}  // namespace defrec::cli
