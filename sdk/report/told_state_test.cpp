#include "sdk/report/told_state.hpp"

#include <doctest/doctest.h>

#include "sdk/report/reason_words.hpp"

using namespace defrec::cli;

namespace {

FrameRecord frame(const char* state, const char* reasons, double timestamp_ms, double seen = 0.8) {
    FrameRecord record;
    record.state = state;
    record.reasons = reasons;
    record.timestamp_ms = timestamp_ms;
    record.observed_share = seen;
    return record;
}

}  // namespace

TEST_CASE("a run that begins with a template of before finds tissue, and finds it again later") {
    ToldState told;
    CHECK(told.take(frame("lost", "", 0)) == "unfound");
    CHECK(told.take(frame("relocalised", "", 100)) == "found");
    CHECK(told.take(frame("tracking", "", 5000)) == "found");
    CHECK(told.take(frame("tracking", "", 5200)) == "tracking");
    CHECK(told.take(frame("lost", "", 5300)) == "lost");
    CHECK(told.take(frame("relocalised", "", 5400)) == "relocalised");
}

TEST_CASE("what a picture shows that stands still is not told as followed") {
    ToldState told;
    CHECK(told.take(frame("tracking", "", 0)) == "tracking");
    CHECK(told.take(frame("degraded", "frozen", 300)) == "degraded");
    const std::string stalled = told.take(frame("degraded", "frozen", 900));
    CHECK(word_of_state(stalled) == "No new picture");
    CHECK(doubt_of(stalled) == Doubt::frozen);
}

TEST_CASE("positions that are not to be used are told with what they lack") {
    ToldState told;
    CHECK(told.take(frame("degraded", "dark, one-view", 0, 0)) == "degraded");
    CHECK(told.take(frame("degraded", "dark, one-view", 600, 0)) == "one-view");
    CHECK(told.take(frame("degraded", "occluded", 700, 0)) == "unseen");
    FrameRecord late = frame("degraded", "view-late", 750, 0);
    late.faulty_views = "right";
    CHECK(told.take(late) == "one-view");
    FrameRecord far = frame("tracking", "", 800);
    far.points.resize(1);
    far.points[0].status = VertexStatus::extrapolated;
    far.points[0].is_chosen = true;
    far.points[0].covariance[0] = 16;
    CHECK(told.take(far) == "large-errors");
    CHECK(doubt_of("large-errors") == Doubt::unusable);
    CHECK(doubt_of("found") == Doubt::none);
}

TEST_CASE("a frame that large errors of points make less sure has them among its reasons") {
    FrameRecord record = frame("tracking", "contradicted", 0);
    record.points.resize(2);
    for (PointEstimate& point : record.points) {
        point.status = VertexStatus::extrapolated;
        point.is_chosen = true;
        point.covariance[0] = 0.25f;
    }
    CHECK(reasons_told(record, ToldState().take(record)) == "contradicted");
    record.points[1].covariance[0] = 16;
    ToldState told;
    CHECK(told.take(record) == "degraded");
    CHECK(reasons_told(record, "degraded") == "contradicted, point-error");
    CHECK(reasons_in_words("contradicted, point-error", "").at(0) ==
          "a chosen point has an expected error above 3 mm");
    CHECK(ShownState::kMostErrorMm == 3);  // as the words have it
    record.reasons.clear();
    CHECK(reasons_told(record, "degraded") == "point-error");
    CHECK(reasons_told(record, "found").empty());
}
