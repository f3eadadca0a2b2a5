// See device_wait.hpp.
#include "sdk/tracking/device_wait.hpp"

#include <algorithm>
#include <thread>

#include "sdk/base/os/platform.hpp"

namespace defrec {
namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

// A wait that ends too early may cost a call of the driver. Each looks for a while before it
// sleeps: many short ones would keep a core busy through a long frame. A long wait is slept through
// up to its last part, a nap at a time: on a device that many trackers share, cores that look for
// its end are missing elsewhere.
void DeviceWait::wait(const Work& work, Time limit) {
    constexpr Time kWaking = std::chrono::microseconds(45),
                   kLongestNap = std::chrono::microseconds(500),
                   kFirstLook = std::chrono::microseconds(200);
    start_ = Clock::now();
    const auto since_start = [this]() -> Time { return Clock::now() - start_; };
    const Time usual = std::min(usual_, limit), last_part = usual / 8,
               asleep = last_part > platform::sleep_error() ? usual - last_part : Time::zero();
    Time look = kFirstLook, wake = usual - kWaking;
    bool looks = true, wakes = wake > Time::zero();
    for (Time waited{0};; waited = since_start()) {
        looks = looks && look < limit && !work.look_ahead();
        if (wakes && waited >= wake) {
            wakes = false;
            work.wake();
        }
        const bool naps = waited < asleep;
        if (!looks && !wakes && !naps) return;
        const Time until = std::min(looks ? look : limit, wakes ? wake : limit),
                   left = std::max(until - waited, Time::zero());
        if (work.is_done(naps ? 0 : static_cast<uint64_t>(left.count()))) return;
        if (naps)
            std::this_thread::sleep_for(std::min({left, asleep - waited, last_part, kLongestNap}));
        if (until == look && (!naps || since_start() >= look)) look *= 2;
    }
}

// Beyond a short wait, one frame that took long is not yet usual.
void DeviceWait::end() {
    constexpr Time kShort = std::chrono::milliseconds(1);
    const Time waited = Clock::now() - start_;
    usual_ += (std::min(waited, std::max(2 * usual_, kShort)) - usual_) / 4;
}

}  // namespace defrec
