// What is said of views that are not of one time, and of the calibration meanwhile.
#include "sdk/session/view_lag.hpp"

#include <doctest/doctest.h>

#include "sdk/client/library.hpp"

using namespace defrec::cli;

namespace {

ViewLag lag_of(int late, int all, float frames) {
    ViewLag lag;
    for (int i = 0; i < all; ++i) {
        auto result = initialised<defrec_result>();
        if (i < late) {
            result.reasons = DEFREC_REASON_VIEW_LATE;
            result.view_lag_frames = frames;
        }
        lag.add(result, false);
    }
    return lag;
}

}  // namespace

TEST_CASE("a lag in many frames is told with its size, and that the calibration cannot be judged") {
    const ViewLag late = lag_of(35, 39, 0.96f);
    CHECK(late.is_lasting(37));
    CHECK(late.is_in_most());
    CHECK(late.note(37).find("In 35 of 39 frames left and right view were taken at different "
                             "times: the right view is 1.0 frames late (median). Mend that") == 0);
    CHECK(lag_of(14, 21, -1.1f).note(21).find("1.1 frames early") != std::string::npos);
}

TEST_CASE("a lag of some frames excuses no calibration that differs in all of them") {
    const ViewLag some = lag_of(5, 100, 1);
    CHECK_FALSE(some.is_lasting(5));
    CHECK(some.note(5).find("In some frames left and right view") == 0);
    CHECK_FALSE(lag_of(20, 100, 1).is_lasting(100));
    CHECK(lag_of(20, 100, 1).is_lasting(30));
    CHECK(lag_of(0, 100, 1).note(0).empty());
}

TEST_CASE("a view that stands still is no lag") {
    auto result = initialised<defrec_result>();
    result.reasons = DEFREC_REASON_VIEW_LATE;
    ViewLag lag;
    lag.add(result, true);
    CHECK(lag.frames() == 1);
    CHECK(lag.note(0).empty());
}
