// Positions between frames, and which frames are kept.
#include "sdk/predictor/motion_history.hpp"

#include <doctest/doctest.h>

#include "sdk/predictor/decisions.hpp"

using namespace defrec;

namespace {

// A point on a cubic.
Eigen::Vector3d on_cubic(double time) {
    return {1 + time, 2 - time * time, 3 * time * time * time - time};
}

void add(MotionHistory& history, double time) { history.add(time, 1).xyz.col(0) = on_cubic(time); }

}  // namespace

TEST_CASE("a cubic is met between frames, however they are spaced, and at a frame as it is") {
    MotionHistory history;
    for (const double time : {0.0, 0.9, 2.1, 2.9, 4.2, 5.0}) add(history, time);
    for (const double time : {0.3, 1.5, 2.5, 3.3, 4.1}) {
        const Taps taps = history.taps(time, 1e-3);
        CHECK(taps.count == (time < 0.9 ? 3 : 4));
        if (taps.count == 4) CHECK((history.position(taps, 0) - on_cubic(time)).norm() < 1e-12);
    }
    for (const double time : {2.1, 2.1005, 2.0995, 5.0, 5.3}) {
        const Taps taps = history.taps(time, 1e-3);
        CHECK(taps.count == 1);
        CHECK(taps.weights[0] == 1);
        CHECK(history.position(taps, 0) == on_cubic(time > 3 ? 5.0 : 2.1));
    }
    CHECK(history.taps(-0.1, 1e-3).count == 0);
    CHECK(history.taps(-0.0005, 1e-3).count == 1);
}

TEST_CASE("frames that are let go are gone, and numbers go on") {
    MotionHistory history;
    for (int i = 0; i < 10; ++i) add(history, i);
    CHECK(history.oldest() == 0);
    history.forget_before(7);
    history.forget_before(3);
    CHECK(history.oldest() == 7);
    CHECK(history.newest() == 9);
    CHECK(history.taps(6.9, 1e-3).count == 0);
    CHECK(history.last_before(8.5) == 8);
    history.forget();
    CHECK(history.is_empty());
    CHECK(history.taps(9, 1e-3).count == 0);
    add(history, 12);
    CHECK(history.newest() == 10);
    CHECK(history.oldest() == 10);
    CHECK(history.at(10).xyz.col(0) == on_cubic(12));
}

TEST_CASE("no more frames are kept than decided, the last ones") {
    MotionHistory history;
    const std::size_t most = decisions::PredictionGrid::kMaxFrames;
    for (std::size_t i = 0; i < 3 * most; ++i) add(history, static_cast<double>(i));
    CHECK(history.newest() - history.oldest() + 1 == most);
    for (uint64_t number = history.oldest(); number <= history.newest(); ++number)
        CHECK(history.at(number).time_s == static_cast<double>(number));
}
