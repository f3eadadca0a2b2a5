// Fields of a result as they stand in frames.csv.
#include "sdk/session/result_record.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>

using namespace defrec::cli;

TEST_CASE("a frame in which nothing was measured has no residual") {
    defrec_result result{};
    result.vertex_count = 100;
    result.mean_residual_mm = 0.25;
    const auto residual = [&](std::uint32_t state, float observed_share) {
        result.state = state;
        result.observed_share = observed_share;
        return frame_row({}, result).mean_residual_mm;
    };
    CHECK(residual(DEFREC_TRACKING, 0.5f) == 0.25);
    CHECK(residual(DEFREC_DEGRADED, 0.1f) == 0.25);
    CHECK(std::isnan(residual(DEFREC_DEGRADED, 0)));  // one view alone shows the tissue
    CHECK(std::isnan(residual(DEFREC_LOST, 0)));
    CHECK(std::isnan(residual(DEFREC_INITIALISING, 0)));
}

TEST_CASE("the views of which reasons speak are named in frames.csv and to the pages") {
    const auto named = [](std::uint32_t views) {
        defrec_result result{};
        result.faulty_views = views;
        return frame_row({}, result).faulty_views;
    };
    CHECK(named(0) == "");
    CHECK(named(DEFREC_VIEW_LEFT) == "left");
    CHECK(named(DEFREC_VIEW_RIGHT) == "right");
    CHECK(named(DEFREC_VIEW_LEFT | DEFREC_VIEW_RIGHT) == "both");
}
