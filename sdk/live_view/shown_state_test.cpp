#include "sdk/live_view/shown_state.hpp"

#include <doctest/doctest.h>

using defrec::cli::ShownState;

TEST_CASE("found again is said for some seconds of the pictures, and not while it is lost") {
    ShownState state;
    CHECK(state.take("initialising", 0) == "initialising");
    CHECK(state.take("tracking", 100) == "tracking");
    CHECK(state.take("lost", 200) == "lost");
    CHECK(state.take("relocalised", 300) == "relocalised");
    CHECK(state.take("tracking", 400) == "relocalised");
    CHECK(state.take("degraded", 299 + ShownState::kFoundMs) == "relocalised");
    CHECK(state.take("degraded", 300 + ShownState::kFoundMs) == "degraded");
    CHECK(state.take("tracking", 400) == "tracking");  // it has been said
    CHECK(state.take("lost", 20000) == "lost");
    CHECK(state.take("relocalised", 20100) == "relocalised");
    CHECK(state.take("lost", 20200) == "lost");
    CHECK(state.take("tracking", 20300) == "tracking");
    CHECK(state.take("relocalised", 20400) == "relocalised");
    CHECK(state.take("tracking", 0) == "tracking");  // the recording starts again
}

TEST_CASE("what was never followed was not lost, and is not found again") {
    ShownState state;
    CHECK(state.take("lost", 0) == "unfound");
    CHECK(state.take("relocalised", 100) == "found");
    CHECK(state.take("tracking", 200) == "found");
    CHECK(state.take("tracking", 100 + ShownState::kFoundMs) == "tracking");
    CHECK(state.take("lost", 9000) == "lost");
    CHECK(state.take("relocalised", 9100) == "relocalised");
}
