#include "sdk/report/shown_state.hpp"

#include <doctest/doctest.h>

using defrec::cli::ShownState;
using defrec::cli::Support;

TEST_CASE("found again is said for some seconds of the pictures, and not while it is lost") {
    ShownState state;
    CHECK(state.take("initialising", "", 0) == "initialising");
    CHECK(state.take("tracking", "", 100) == "tracking");
    CHECK(state.take("lost", "", 200) == "lost");
    CHECK(state.take("relocalised", "", 300) == "relocalised");
    CHECK(state.take("tracking", "", 400) == "relocalised");
    // The worse of both is said.
    CHECK(state.take("degraded", "", 500) == "degraded");
    CHECK(state.found() == "relocalised");
    CHECK(state.take("tracking", "", 299 + ShownState::kFoundMs) == "relocalised");
    CHECK(state.take("degraded", "", 299 + ShownState::kFoundMs) == "degraded");
    CHECK(state.found() == "relocalised");
    CHECK(state.take("degraded", "", 300 + ShownState::kFoundMs) == "degraded");
    CHECK(state.found().empty());
    CHECK(state.take("tracking", "", 400) == "tracking");  // it has been said
    CHECK(state.take("lost", "", 20000) == "lost");
    CHECK(state.take("relocalised", "", 20100) == "relocalised");
    CHECK(state.take("lost", "", 20200) == "lost");
    CHECK(state.take("tracking", "", 20300) == "tracking");
    CHECK(state.take("relocalised", "", 20400) == "relocalised");
    CHECK(state.take("tracking", "", 0) == "tracking");  // the recording starts again
}

TEST_CASE("what was never followed was not lost, and is not found again") {
    ShownState state;
    CHECK(state.take("lost", "", 0) == "unfound");
    CHECK(state.take("relocalised", "", 100) == "found");
    CHECK(state.take("tracking", "", 200) == "found");
    CHECK(state.take("tracking", "", 100 + ShownState::kFoundMs) == "tracking");
    CHECK(state.take("lost", "", 9000) == "lost");
    CHECK(state.take("relocalised", "", 9100) == "relocalised");
}

TEST_CASE("what was followed is lost where its template is given up") {
    ShownState state;
    CHECK(state.take("initialising", "", 0) == "initialising");
    CHECK(state.take("tracking", "", 100) == "tracking");
    CHECK(state.take("lost", "", 200) == "lost");
    CHECK_FALSE(state.is_given_up());
    CHECK(state.take("initialising", "", 300) == "given-up");
    CHECK(state.take("initialising", "dark, frozen", 400) == "given-up");
    CHECK(state.take("initialising", "dark, frozen", 400 + ShownState::kFrozenMs) == "given-up");
    CHECK(state.take("tracking", "", 1000) == "tracking");
    CHECK(state.take("lost", "", 1100) == "lost");
    CHECK(state.is_given_up());
}

TEST_CASE("a video that stands still for half a second is not of now") {
    ShownState state;
    CHECK(state.take("tracking", "", 0) == "tracking");
    // A single frame that is repeated.
    CHECK(state.take("degraded", "frozen", 40) == "degraded");
    CHECK(state.take("tracking", "", 80) == "tracking");
    CHECK(state.take("tracking", "frozen", 120) == "tracking");
    CHECK(state.take("degraded", "gap, frozen", 119 + ShownState::kFrozenMs) == "degraded");
    CHECK(state.take("degraded", "frozen", 120 + ShownState::kFrozenMs) == "stalled");
    CHECK(state.take("lost", "frozen", 1000) == "stalled");
    CHECK(state.take("degraded", "frozen, one-view, dark", 1100) == "stalled");
    CHECK(state.take("lost", "dark, frozen, no-texture", 1200) == "lost");
    CHECK(state.take("degraded", "frozen", 1300) == "stalled");
    CHECK(state.take("degraded", "few-matches", 1400) == "degraded");
    CHECK(state.take("degraded", "frozen", 1500) == "degraded");
    CHECK(state.take("degraded", "frozen", 200) == "degraded");  // the recording starts again
    CHECK(state.take("degraded", "frozen", 200 + ShownState::kFrozenMs) == "stalled");
}

TEST_CASE("pictures that are black before anything is followed are said to be black") {
    ShownState state;
    CHECK(state.take("initialising", "dark, no-texture", 0) == "initialising");
    CHECK(state.take("initialising", "dark, frozen, no-texture", 100) == "initialising");
    CHECK(state.take("initialising", "dark, frozen, no-texture", 900) == "initialising");
    CHECK(state.take("initialising", "frozen", 1000) == "stalled");
}

TEST_CASE("positions of tissue that is not seen for half a second are not to be used") {
    const Support seen{0.7, {}, {}}, unseen{0.001, 0.5, 4.0};
    ShownState state;
    CHECK(state.take("tracking", "", 0, seen) == "tracking");
    CHECK(state.take("degraded", "one-view", 100, unseen) == "degraded");
    CHECK(state.take("degraded", "one-view", 99 + ShownState::kUnmeasuredMs, unseen) == "degraded");
    CHECK(state.take("degraded", "one-view", 100 + ShownState::kUnmeasuredMs, unseen) ==
          "unusable");
    // A repeated picture tells nothing new.
    CHECK(state.take("tracking", "frozen", 700, unseen) == "unusable");
    CHECK(state.take("tracking", "", 800, seen) == "tracking");
    CHECK(state.take("tracking", "frozen", 900, unseen) == "degraded");
    CHECK(state.take("tracking", "frozen", 1300, Support{0, {}, {}}) == "tracking");
    CHECK(state.take("degraded", "", 1400, unseen) == "degraded");
    CHECK(state.take("lost", "", 1500, unseen) == "lost");
    CHECK(state.take("relocalised", "", 2000, unseen) == "degraded");
    CHECK(state.take("tracking", "", 2500, unseen) == "unusable");
    CHECK(state.take("degraded", "", 100, unseen) == "degraded");  // the recording starts again
    CHECK(state.take("degraded", "", 600, Support{}) == "degraded");
}

TEST_CASE("points with large errors are less sure, and not to be used where all have them") {
    const double large = ShownState::kMostErrorMm + 0.1;
    ShownState state;
    CHECK(state.take("tracking", "", 0, Support{0.7, 0.2, 3.0}) == "tracking");
    CHECK(state.take("tracking", "", 50, Support{0.7, 0.2, 3.04}) == "tracking");  // as shown
    CHECK(state.take("tracking", "", 100, Support{0.7, 0.2, large}) == "degraded");
    CHECK(state.take("tracking", "", 1000, Support{0.7, 0.2, large}) == "degraded");
    CHECK(state.take("tracking", "", 1100, Support{0.7, large, large}) == "degraded");
    CHECK(state.take("tracking", "", 1600, Support{0.7, large, large}) == "unusable");
    CHECK(state.take("tracking", "", 1700, Support{0.7, 0.2, 0.3}) == "tracking");
}
