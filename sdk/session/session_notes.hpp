// What the user of a tracked sequence is told at its end, beside the numbers.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sdk/session/point_follower.hpp"

namespace defrec::cli {

class SessionNotes {
  public:
    void add(std::string note) {
        if (!note.empty()) notes_.push_back(std::move(note));
    }
    // DEFREC_REASON_* of a frame.
    void add_reasons(std::uint32_t reasons) { reasons_ |= reasons; }
    // The template was taken of this frame, later than the first.
    void add_late_template(std::int64_t frame, bool has_targets);
    // At the end of the run, once.
    void conclude(const PointFollower& points, bool has_template);

    std::span<const std::string> all() const { return notes_; }

  private:
    std::vector<std::string> notes_;
    std::uint32_t reasons_ = 0;  // of all frames
};

}  // namespace defrec::cli
