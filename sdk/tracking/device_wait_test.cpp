// How the tracker's thread waits: what it does meanwhile, and in which order. No test depends on
// how long anything takes.
#include "sdk/tracking/device_wait.hpp"

#include <doctest/doctest.h>

#include <thread>

using defrec::DeviceWait;
using namespace std::chrono_literals;

namespace {

constexpr DeviceWait::Time kLimit = 10s;

// A frame that takes that long.
void take(DeviceWait& wait, DeviceWait::Time time) {
    wait.wait({[&](uint64_t) { return true; }, [] { return true; }, [] {}}, kLimit);
    std::this_thread::sleep_for(time);
    wait.end();
}

}  // namespace

TEST_CASE("a wait looks ahead while something may come, and ends when the device is done") {
    DeviceWait wait;
    int looks = 0, asked = 0, woken = 0;
    const auto is_done = [&](uint64_t timeout_ns) {
        CHECK(timeout_ns <= static_cast<uint64_t>(kLimit.count()));
        return ++asked == 4;
    };
    const auto look_ahead = [&] {
        ++looks;
        return false;
    };
    wait.wait({is_done, look_ahead, [&] { ++woken; }}, kLimit);
    CHECK(asked == 4);
    CHECK(looks == 4);
    CHECK(woken == 0);  // the first frame is expected at no time
}

TEST_CASE("with nothing to look for and no time to expect it, the last wait is the caller's") {
    DeviceWait wait;
    int asked = 0;
    wait.wait({[&](uint64_t) { return ++asked == 0; }, [] { return true; }, [] {}}, kLimit);
    CHECK(asked == 0);
}

TEST_CASE("before the device is expected to be done it wakes the others, once") {
    DeviceWait wait;
    for (int i = 0; i < 4; ++i) take(wait, 2ms);
    int woken = 0;
    wait.wait({[&](uint64_t) { return woken > 0; }, [] { return true; }, [&] { ++woken; }}, kLimit);
    CHECK(woken == 1);
}

TEST_CASE("one frame that took long is not yet usual") {
    DeviceWait wait;
    take(wait, 50ms);
    // At most a quarter of the short wait is expected now: what wakes then ends the wait, long
    // before the limit that a usual wait of 50 ms would sleep towards.
    int naps = 0;
    bool is_woken = false;
    wait.wait({[&](uint64_t timeout_ns) {
                   if (timeout_ns == 0) ++naps;
                   return is_woken;
               },
               [] { return true; }, [&] { is_woken = true; }},
              kLimit);
    CHECK(is_woken);
    CHECK(naps <= 4);
}
