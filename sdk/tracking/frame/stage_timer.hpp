// The times of a frame's stages, into its output.
#pragma once
#include <algorithm>
#include <chrono>
#include <span>
#include <string_view>

#include "sdk/device/device.hpp"
#include "sdk/tracking/frame/frame_output.hpp"

namespace defrec {

class StageTimer {
  public:
    // timed: the queue whose work is waited for at the end of each stage; nullptr: times are of the
    // host's calls.
    StageTimer(FrameOutput& output, Queue* timed) : output_(output), timed_(timed) { start(); }

    void start() { begin_ = Clock::now(); }
    // A stage that began with the last start or end; of one that ran before, the times are added.
    // name: static storage.
    void end(const char* name) {
        if (timed_ != nullptr) timed_->finish();
        const Clock::time_point now = Clock::now();
        const double ms = std::chrono::duration<double, std::milli>(now - begin_).count();
        begin_ = now;
        const std::span<defrec_stage_time> times(output_.times);
        const auto known = times.first(output_.time_count);
        const auto same = std::find_if(known.begin(), known.end(), [name](const auto& time) {
            return std::string_view(time.name) == name;
        });
        if (same != known.end())
            same->milliseconds += ms;
        else if (output_.time_count < times.size())
            times[output_.time_count++] = {name, ms};
    }

  private:
    using Clock = std::chrono::steady_clock;
    FrameOutput& output_;
    Queue* timed_;
    Clock::time_point begin_;
};

}  // namespace defrec
