// Whether a truth is that of what was tracked, as far as ids, frames and the first positions tell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "sdk/evaluation/score/frame_shift.hpp"
#include "sdk/evaluation/score/tracked_positions.hpp"

namespace defrec::cli {

// In the first frame nothing has been tracked yet: a position there is off by what the measurement
// of depth is off. So a truth that disagrees there is suspect, and one that disagrees later is not.
// At most 3 % of the points of reference sequences are far in the first frame, but 95 % of the
// truths of another sequence have a quarter of them far.
struct TruthLimits {
    static constexpr double kFarExpected = 5;  // a point is far beyond this many expected errors
    static constexpr double kFarMm = 0.1;      // and beyond this, mm: targets may be exact at first
    static constexpr double kMaxFarShare = 0.25;
    static constexpr std::size_t kMinFar = 3;  // or all, where there are fewer
};

// The note by which the truth is of something else, so that no number means anything.
struct TruthDoubt {
    std::string note;         // empty: there is none
    bool is_certain = false;  // something was tracked, and nothing of the truth is in it
};

class TruthCheck {
  public:
    // tracked has to outlive this; noun: "point" or "target".
    TruthCheck(const TrackedPositions& tracked, std::string noun, Unfollowed unfollowed);

    // A row of the truth. is_scored: its frame is among those that were asked for. False where the
    // point has a row in this frame already.
    bool add(const FrameAndId& key, const Xyz& xyz, bool is_visible, bool is_scored);

    bool is_followed(std::int64_t id) const { return tracked_ids_.contains(id); }
    // Points of the scored rows that were not.
    std::size_t not_followed() const { return missing_ids_.size(); }

    // All rows have been added.
    void finish() { shift_ = better_shift(tracked_, true_places_); }

    // The message where no row was scored.
    std::string no_row_of(const std::string& truth, const FrameRange& range) const;

    // A sentence for each thing that does not fit; truth and tracked: how the files are named.
    std::vector<std::string> notes(const std::string& truth, const std::string& tracked) const;
    TruthDoubt doubt(const std::string& truth, const std::string& tracked) const;

  private:
    bool has_other_ids() const { return missing_ids_.size() == true_ids_.size(); }
    bool has_other_frames() const { return missing_frames_.size() == scored_frames_.size(); }
    std::string note_of_other_ids(const std::string& truth, const std::string& tracked) const;
    std::string note_of_other_frames(const std::string& truth, const std::string& tracked) const;
    std::vector<std::string> notes_of_ids(const std::string& truth,
                                          const std::string& tracked) const;
    std::vector<std::string> notes_of_frames(const std::string& truth,
                                             const std::string& tracked) const;
    // The shift of frames, or else places in the first frame.
    std::string note_of_places(const std::string& truth) const;
    std::string question_of_places(const std::string& truth) const;

    const TrackedPositions& tracked_;
    std::string noun_;
    Unfollowed unfollowed_;
    std::set<std::int64_t> tracked_ids_, tracked_frames_;
    std::set<std::int64_t> true_frames_;
    // Ids and frames of scored rows, and which of them were not tracked.
    std::set<std::int64_t> true_ids_, missing_ids_, scored_frames_, missing_frames_;
    std::int64_t first_frame_ = 0;  // with a position
    std::size_t compared_ = 0;      // visible in that frame, with position and expected error
    std::vector<double> far_mm_;    // how far the far ones of them are
    std::vector<double> scales_;    // their distance from the camera by the truth, as tracked 1
    std::unordered_set<FrameAndId, FrameAndIdHash> rows_;
    TruePositions true_places_;  // of what can be seen
    std::optional<FrameShift> shift_;
};

}  // namespace defrec::cli
