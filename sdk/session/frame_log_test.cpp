// What is kept of each frame of a run.
#include "sdk/session/frame_log.hpp"

#include <doctest/doctest.h>

using namespace defrec::cli;

TEST_CASE("a frame is kept in some two hundred bytes, its texts once for all frames") {
    FrameLog frames;
    FrameRow row;
    row.state = "degraded";
    row.reasons = "large-residual|contradicted|view-late|low-contrast";
    row.stage_ms = {{"stereo", 1.5}, {"align", 1}, {"align", 0.25}};
    frames.add(row);
    row.frame = 1;
    row.stage_ms = {{"lm", 2}, {"align", 0.5}};
    frames.add(row);
    REQUIRE(frames.rows().size() == 2);
    CHECK(frames.rows()[1].frame == 1);
    CHECK(*frames.rows()[0].reasons == row.reasons);
    CHECK(frames.rows()[0].reasons == frames.rows()[1].reasons);
    CHECK(frames.rows()[0].state == frames.rows()[1].state);
    REQUIRE(frames.stages().size() == 3);
    CHECK(frames.stages()[0].name == "stereo");
    CHECK(frames.stages()[0].ms == std::vector<float>{1.5, 0});
    CHECK(frames.stages()[1].ms == std::vector<float>{1.25, 0.5});
    CHECK(frames.stages()[2].ms == std::vector<float>{0, 2});
    constexpr std::size_t kStages = 13;
    CHECK(sizeof(FrameLog::Row) + kStages * sizeof(float) < 200);
}
