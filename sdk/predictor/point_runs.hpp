// How long each point was followed without a break.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdk/predictor/motion_history.hpp"

namespace defrec {

// A frame's answer for each point, as defrec_predictor_frame has it.
struct FollowedPoints {
    int64_t time_ns = 0;
    bool is_followed = false;  // false: lost, or no template; then all arrays may be null
    uint32_t epoch = 0;
    const double* xyz = nullptr;
    const uint8_t* status = nullptr;
    const double* expected_error_mm = nullptr;  // null: 0
};

// The predictions that a point allows: each includes those before it.
enum class Reach : unsigned char { kUnknown, kPosition, kVelocity, kLearned };

class PointRuns {
  public:
    explicit PointRuns(std::size_t points) : first_(points), is_known_(points) {}

    std::size_t size() const { return first_.size(); }
    // Nothing is known of any.
    void end_all();
    // The newest frame of the history gets these positions; a run begins anew where the point was
    // unknown or moved by more than max_motion_mm.
    void add(const FollowedPoints& frame, double max_motion_mm, MotionHistory& history);

    // Whether the point was followed in the last frame, and in all from that number on.
    bool covers(std::size_t point, uint64_t frame) const {
        return is_known_[point] != 0 && first_[point] <= frame;
    }
    bool is_known(std::size_t point) const { return is_known_[point] != 0; }
    // By the lags of the newest frame.
    Reach reach(std::size_t point, const MotionFrame& newest) const;

  private:
    std::vector<uint64_t> first_;  // number of the run's first frame
    std::vector<uint8_t> is_known_;
};

}  // namespace defrec
