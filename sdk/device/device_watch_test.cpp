// When a call counts as stuck.
#include "sdk/device/device_watch.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <string>
#include <thread>

using namespace defrec;
using namespace std::chrono_literals;

namespace {

constexpr std::chrono::milliseconds kLimit = 80ms;

struct Watched {
    DeviceWatch watch{kLimit};
    Watched() {
        watch.watch_this_thread();
        watch.enter("lm");
    }
    DeviceWatch::Outcome wait_until(DeviceWatch::Clock::time_point end) const {
        std::mutex mutex;
        std::condition_variable changed;
        std::unique_lock lock(mutex);
        return watch.wait_until(changed, lock, end, [] { return false; });
    }
};

}  // namespace

TEST_CASE("a call that somebody waits for is stuck after the limit, and not before") {
    const auto begin = DeviceWatch::Clock::now();
    const Watched watched;
    CHECK(watched.wait_until(begin + 1h) == DeviceWatch::Outcome::kStuck);
    CHECK(DeviceWatch::Clock::now() - begin > kLimit);
    CHECK(watched.watch.stuck_in() == std::string("lm"));
}

TEST_CASE("a call that nobody looked at has an eighth of the limit to end in") {
    Watched watched;
    std::this_thread::sleep_for(2 * kLimit);  // as if the process was stopped
    CHECK(watched.watch.stuck_in() == nullptr);
    std::this_thread::sleep_for(kLimit / 8 + 1ms);
    CHECK(watched.watch.stuck_in() == std::string("lm"));

    watched.watch.leave();
    CHECK(watched.watch.stuck_in() == nullptr);
    watched.watch.enter("align");
    std::this_thread::sleep_for(2 * kLimit);
    CHECK(watched.watch.stuck_in() == nullptr);
}

TEST_CASE("a call that is looked at again and again, without a wait, is stuck as well") {
    const Watched watched;
    DeviceWatch::Outcome outcome = DeviceWatch::Outcome::kTimeout;
    while (outcome == DeviceWatch::Outcome::kTimeout)
        outcome = watched.wait_until(DeviceWatch::Clock::now());
    CHECK(outcome == DeviceWatch::Outcome::kStuck);
}
