#include "sdk/tracking/frame/stage_timer.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace defrec;

TEST_CASE("a stage that runs twice in a frame has one time, the sum") {
    FrameOutput output;
    StageTimer timer(output, nullptr);
    timer.end("lm");
    timer.end("warp");
    REQUIRE(output.time_count == 2);
    output.times[0].milliseconds = 1000;
    timer.end("lm");
    CHECK(output.time_count == 2);
    CHECK(output.times[0].name == std::string("lm"));
    CHECK(output.times[0].milliseconds >= 1000);
    CHECK(output.times[1].name == std::string("warp"));
}
