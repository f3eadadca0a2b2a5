// The state as the page says it. Tissue that is found again is said to be so for some seconds,
// since a single frame is not seen; what was never followed was not lost, as at the start of a run
// with --from-template; what was followed is lost where its template is given up; what a video
// shows that stands still is not of now; and positions that are not measured are not to be used.
#pragma once

#include <optional>
#include <string>

namespace defrec::cli {

// The evidence on which the positions of a frame rest.
struct Support {
    double seen_share = 1;  // of the tissue; NaN: not known
    // The smallest and the largest expected error of points that users chose and that have a
    // place, mm; none without such a point.
    std::optional<double> least_error, largest_error;
};

class ShownState {
  public:
    // Time of the pictures for which "found" or "relocalised" is said, in place of tracking.
    static constexpr double kFoundMs = 5000;
    // Time of the pictures for which they stand still before "stalled" is said: single ones are
    // repeated where a source of 25 frames/s is sent at 30.
    static constexpr double kFrozenMs = 500;
    // Likewise, for which nothing is measured before "unusable" is said.
    static constexpr double kUnmeasuredMs = 500;
    // A point with a larger expected error is "degraded" at best: one view alone leaves errors of
    // 3 mm and more along the line of sight, and margins in the operating room are as small.
    static constexpr double kMostErrorMm = 3;
    // By the value as it is shown, rounded to 0.1 mm.
    static bool is_too_large(double error_mm);
    // A smaller share of the tissue is 0 % in words.
    static constexpr double kLeastSeen = 0.005;

    // state, reasons: the tracker's, of one frame after the other. Returns the state, or what is
    // said in its place, "found", "unfound", "given-up", "stalled" and "unusable" among that.
    std::string take(const std::string& state, const std::string& reasons, double timestamp_ms,
                     const Support& support = {});
    // "found" or "relocalised" in that time, also of a frame that is degraded; else empty.
    const std::string& found() const { return found_; }
    // Whether a template was given up: targets and plan belong to the first one.
    bool is_given_up() const { return is_given_up_; }

  private:
    std::string state_of_tissue(const std::string& state, double timestamp_ms);
    bool stands_still(const std::string& reasons, double timestamp_ms);
    bool is_unusable(const std::string& reasons, double timestamp_ms, const Support& support);

    bool was_followed_ = false, is_given_up_ = false;
    std::string found_;
    double found_at_ms_ = 0;
    std::optional<double> frozen_from_ms_, unmeasured_from_ms_;
};

// The reason by which large errors of points alone make a frame "degraded"; the tracker has none.
inline constexpr char kPointErrorReason[] = "point-error";
// The reasons of a frame that is said to be in this state, that one among them where it holds.
std::string reasons_of(const std::string& said, const std::string& reasons, const Support& support);

}  // namespace defrec::cli
