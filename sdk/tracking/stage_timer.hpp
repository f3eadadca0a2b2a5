// The times of a frame's stages, into its output.
#pragma once
#include <chrono>

#include "sdk/device/device.hpp"
#include "sdk/tracking/frame_output.hpp"

namespace defrec {

class StageTimer {
  public:
    // timed: the queue whose work is waited for at the end of each stage; nullptr: times are of the
    // host's calls.
    StageTimer(FrameOutput& output, Queue* timed) : output_(output), timed_(timed) { start(); }

    void start() { begin_ = Clock::now(); }
    // A stage that began with the last start or end. name: static storage.
    void end(const char* name) {
        if (timed_ != nullptr) timed_->finish();
        const Clock::time_point now = Clock::now();
        if (output_.time_count < output_.times.size())
            output_.times[output_.time_count++] = {
                name, std::chrono::duration<double, std::milli>(now - begin_).count()};
        begin_ = now;
    }

  private:
    using Clock = std::chrono::steady_clock;
    FrameOutput& output_;
    Queue* timed_;
    Clock::time_point begin_;
};

}  // namespace defrec
