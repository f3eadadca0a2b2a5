// A truth whose frames are numbered otherwise is told; a tracker that lags is not taken for one.
#include "sdk/evaluation/score/frame_shift.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>

#include "sdk/evaluation/score/truth_check.hpp"

using namespace defrec::cli;

namespace {

constexpr int kFrames = 26, kIds = 8;
constexpr double kNoise = 0.05;

// Where the points of one recording truly are: they breathe by 4 mm, from where they are at rest.
Xyz place_of(std::int64_t frame, std::int64_t id) {
    const auto phase = 0.3 * static_cast<double>(frame);
    return {10.0 * static_cast<double>(id), 2 * (1 - std::cos(phase)), 80};
}

TrackedPositions tracked_as(const std::function<Xyz(std::int64_t, std::int64_t)>& place) {
    TrackedPositions positions;
    for (std::int64_t frame = 0; frame < kFrames; ++frame) {
        for (std::int64_t id = 0; id < kIds; ++id) {
            Xyz xyz = place(frame, id);
            xyz[2] += id % 2 == 0 ? kNoise : -kNoise;
            positions[{frame, id}] = TrackedPosition{xyz, "tracked", kNoise};
        }
    }
    return positions;
}

// Frames `first` to `last` of the recording, numbered so much too high.
TruePositions truth_of(std::int64_t first, std::int64_t last, std::int64_t shift) {
    TruePositions truth;
    for (std::int64_t frame = first; frame <= last; ++frame)
        for (std::int64_t id = 0; id < kIds; ++id) truth[{frame + shift, id}] = place_of(frame, id);
    return truth;
}

std::int64_t shift_of(const TrackedPositions& tracked, const TruePositions& truth) {
    const auto shift = better_shift(tracked, truth);
    return shift ? shift->shift : 0;
}

}  // namespace

TEST_CASE("a truth that fits as numbered has no shift") {
    const TrackedPositions tracked = tracked_as(place_of);
    CHECK(shift_of(tracked, truth_of(0, kFrames - 1, 0)) == 0);
    CHECK(shift_of(tracked, truth_of(5, kFrames - 1, 0)) == 0);
    CHECK(shift_of(tracked, {}) == 0);
    CHECK(shift_of({}, truth_of(0, 9, 0)) == 0);
}

TEST_CASE("a truth whose frames are numbered otherwise is told by how it fits") {
    const TrackedPositions tracked = tracked_as(place_of);
    for (const std::int64_t shift : {1, 2, 5, 100}) {
        CAPTURE(shift);
        CHECK(shift_of(tracked, truth_of(0, kFrames - 1, shift)) == shift);
    }
    // The first rows are cut off, and what is left is counted from 0.
    for (const std::int64_t shift : {-1, -2}) {
        CAPTURE(shift);
        CHECK(shift_of(tracked, truth_of(-shift, kFrames - 1, shift)) == shift);
    }
}

TEST_CASE("a tracker that lags or stays is not taken for a truth that is shifted") {
    const TruePositions truth = truth_of(0, kFrames - 1, 0);
    for (const std::int64_t lag : {1, 2}) {
        CAPTURE(lag);
        const auto lagging = [lag](std::int64_t frame, std::int64_t id) {
            return place_of(std::max<std::int64_t>(0, frame - lag), id);
        };
        CHECK(shift_of(tracked_as(lagging), truth) == 0);
    }
    const auto still = [](std::int64_t, std::int64_t id) { return place_of(0, id); };
    for (const std::int64_t last : {4, kFrames - 1}) {
        CHECK(shift_of(tracked_as(still), truth_of(0, last, 0)) == 0);
        CHECK(shift_of(tracked_as(still), truth_of(3, last, 0)) == 0);
    }
}

TEST_CASE("the truth of something else, and too few points, have no shift") {
    const TrackedPositions tracked = tracked_as(place_of);
    TruePositions other = truth_of(0, kFrames - 1, 1);
    for (auto& [key, xyz] : other) xyz[0] += 3;
    CHECK(shift_of(tracked, other) == 0);
    CHECK(shift_of(tracked, truth_of(0, 5, 1)) == 0);
    TruePositions huge = truth_of(0, kFrames - 1, 0);
    huge[{INT64_MIN, 0}] = huge[{INT64_MAX, 0}] = place_of(0, 0);
    CHECK(shift_of(tracked, huge) == 0);
}

TEST_CASE("the sentence says how the numbers would fit, and the check doubts the truth") {
    const TrackedPositions tracked = tracked_as(place_of);
    const auto doubt_of = [&](const TruePositions& truth) {
        TruthCheck check(tracked, "point", Unfollowed::kLeftOut);
        for (const auto& [key, xyz] : truth) check.add(key, xyz, true, true);
        check.finish();
        const TruthDoubt doubt = check.doubt("truth.csv", "points.csv");
        CHECK(check.notes("truth.csv", "points.csv").back() == doubt.note);
        return doubt;
    };
    const TruthDoubt one = doubt_of(truth_of(0, kFrames - 1, 1));
    CHECK_FALSE(one.is_certain);
    CHECK(one.note.find("truth.csv fits clearly better where its frame numbers are 1 lower: the "
                        "median over 200 points is then 0.050 mm instead of ") == 0);
    CHECK(one.note.find("are its frames counted from 1?") != std::string::npos);
    CHECK(doubt_of(truth_of(1, kFrames - 1, -1)).note.find("numbers are 1 higher: ") !=
          std::string::npos);
    const TruthDoubt far = doubt_of(truth_of(0, kFrames - 1, 100));
    CHECK(far.is_certain);
    CHECK(far.note.find("no frame of truth.csv (100 to 125) is in points.csv (0 to 25). truth.csv "
                        "fits well where its frame numbers are 100 lower") == 0);
}
