// The state as the page says it. Tissue that is found again is said to be so for some seconds,
// since a single frame is not seen; and what was never followed was not lost, as at the start of a
// run with --from-template.
#pragma once

#include <string>

namespace defrec::cli {

class ShownState {
  public:
    // Time of the pictures for which "found" or "relocalised" is said, in place of tracking and
    // degraded.
    static constexpr double kFoundMs = 5000;

    // state: the tracker's, of one frame after the other. Returns the same, or what is said in its
    // place, "found" and "unfound" among that.
    std::string take(const std::string& state, double timestamp_ms);

  private:
    bool was_followed_ = false;
    std::string found_;  // what is said; empty: nothing else than the tracker's state
    double found_at_ms_ = 0;
};

}  // namespace defrec::cli
