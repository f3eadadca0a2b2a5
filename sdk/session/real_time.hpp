// Frames of a recorded sequence at the times at which a camera would deliver them.
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "sdk/io/interrupt.hpp"

namespace defrec::cli {

class RealTime {
  public:
    // Returns when the frame of this time is due, the first at once, or when the user wants to end.
    void wait_for(double timestamp_ms) {
        constexpr std::chrono::milliseconds kLookAround{50};
        const auto time = std::chrono::round<Clock::duration>(
            std::chrono::duration<double, std::milli>(timestamp_ms));
        if (!start_) start_ = Clock::now() - time;
        const Clock::time_point due = *start_ + time;
        while (Clock::now() < due && !interrupt_requested()) {
            std::this_thread::sleep_until(std::min(due, Clock::now() + kLookAround));
        }
    }

  private:
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> start_;  // when the frame of time 0 was due
};

}  // namespace defrec::cli
