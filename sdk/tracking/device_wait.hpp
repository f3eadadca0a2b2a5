// How the tracker's thread waits for the device: asleep where the wait is long, awake where it
// ends, and with something to do meanwhile.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>

namespace defrec {

class DeviceWait {
  public:
    using Time = std::chrono::nanoseconds;

    struct Work {
        // Waits up to timeout_ns; true: the device is done.
        std::function<bool(uint64_t timeout_ns)> is_done;
        // Looks for something else to do; true: there will be nothing more.
        std::function<bool()> look_ahead;
        // Called once, shortly before the device is expected to be done.
        std::function<void()> wake;
    };
    // Returns when the device is done, or when no call of work is left but the last wait for it.
    // limit: for the device.
    void wait(const Work& work, Time limit);
    // After each wait and what ends it: the frame's work is over.
    void end();

  private:
    std::chrono::steady_clock::time_point start_;
    Time usual_{0};  // from when the host is ready
};

}  // namespace defrec
