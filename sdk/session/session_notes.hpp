// Notes for the user of a tracked sequence beside the numbers, said at its end or at once.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/io/field_order.hpp"
#include "sdk/session/calibration_drift.hpp"
#include "sdk/session/compression_watch.hpp"
#include "sdk/session/plan_follower.hpp"
#include "sdk/session/point_follower.hpp"
#include "sdk/session/start_errors.hpp"
#include "sdk/session/target_follower.hpp"
#include "sdk/session/view_lag.hpp"

namespace defrec::cli {

inline constexpr char kNothingTracked[] =
    "No point has a position in any frame; nothing was tracked.";

// How far results are touched: not at all, perhaps, or they are wrong or missing.
enum class NoteSeverity { kRemark, kWarning, kError };

class SessionNotes {
  public:
    void add(std::string note, NoteSeverity severity = NoteSeverity::kWarning) {
        if (note.empty()) return;
        notes_.push_back(std::move(note));
        severities_.push_back(severity);
    }
    // DEFREC_SELF_CALIBRATION_*, as the run has it.
    void add_self_calibration(std::uint32_t setting) {
        may_correct_ = setting != DEFREC_SELF_CALIBRATION_CORRECT;
    }
    void add_source(const SourceOptions& source);
    // The frames in order, each with its result. Returns a note that is to be said at once, since
    // it is of the recording as a whole; mostly it is empty.
    std::string add_frame(const StereoFrame& frame, const defrec_result& result);
    // How the images were read; not kAuto.
    void add_fields(FieldOrder fields);
    // Points without a frame are of this one's image, the first that is tracked.
    void add_frame_of_points(std::int64_t first, bool any);
    // The template was taken of another frame than the first.
    struct LateTemplate {
        std::int64_t frame;
        bool is_followed_back, was_asked_for, has_targets;
    };
    void add_late_template(const LateTemplate& late);
    // The template of that frame was given up in this one.
    void add_given_up(std::int64_t template_frame, std::int64_t frame);
    // What a run came to.
    struct Ending {
        bool has_template = false, has_tracked = false;  // any point or target has a position
        std::string unfound_template;  // file that was given, and is found in no frame; or empty
    };
    // At the end of the run, once. targets, plan: null without any.
    void conclude(const PointFollower& points, const TargetFollower* targets,
                  const PlanFollower* plan, const Ending& ending);

    // Left and right show the same picture, as was said.
    bool is_one_view_twice() const { return is_one_view_twice_; }
    const CompressionWatch& compression() const { return compression_; }
    std::span<const std::string> all() const { return notes_; }
    // One for each of all().
    std::span<const NoteSeverity> severities() const { return severities_; }
    // Without those that were to be said at once.
    std::vector<std::string> left_to_say() const;

  private:
    // Whether the views fit each other and the calibration.
    void add_rig();
    void add_points(const PointFollower& points);
    // places: of all; is_any_placed: in any frame.
    void add_targets(const TargetPlacesNote& places, const char* name, bool is_any_placed,
                     bool has_tracked);
    void add_untracked(const Ending& ending);

    std::vector<std::string> notes_;
    std::vector<NoteSeverity> severities_;
    std::uint32_t reasons_ = 0;      // of all frames
    std::uint32_t still_views_ = 0;  // DEFREC_VIEW_*: that stood still while the other one did not
    bool is_one_view_twice_ = false;
    std::string swapped_note_ = "The two images look swapped; exchange --left and --right.";
    CalibrationDrift drift_;
    ViewLag lag_;
    bool may_correct_ = true;  // the calibration, where it has drifted
    CompressionWatch compression_;
    StartErrors start_errors_;
    int looked_at_ = 0;             // frames, for their detail
    std::optional<int> finest_px_;  // of it
    std::vector<std::string> said_;
};

}  // namespace defrec::cli
