// Which clock stamps have.
#include "sdk/live_link/link_clock.hpp"

#include <doctest/doctest.h>

using namespace defrec::cli;
using std::chrono::nanoseconds;
using std::chrono::seconds;
using std::chrono::system_clock;

namespace {

constexpr std::int64_t kNow = 1'760'000'000'123'456'789;

}  // namespace

TEST_CASE("the input's clock is sent as it is") {
    LinkClock clock(false, [] { return system_clock::time_point(seconds(1'760'000'000)); });
    clock.take(5);
    CHECK(clock.stamp(5) == 5);
    CHECK(clock.stamp(33'333'333) == 33'333'333);
}

TEST_CASE("the system's clock is that of the first frame, and goes on with the input's") {
    std::int64_t now = kNow;
    LinkClock clock(true, [&] {
        return system_clock::time_point(
            std::chrono::duration_cast<system_clock::duration>(nanoseconds(now)));
    });
    constexpr std::int64_t kFirst = 2'000'000'000;
    clock.take(kFirst);
    CHECK(clock.stamp(kFirst) == kNow);
    now -= 3'600'000'000'000;  // somebody sets it back
    clock.take(kFirst + 33'333'333);
    CHECK(clock.stamp(kFirst + 33'333'333) == kNow + 33'333'333);
    CHECK(clock.stamp(0) == kNow - kFirst);
}
