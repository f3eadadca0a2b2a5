#include "sdk/tracking/monitors/stream_check.hpp"

#include <doctest/doctest.h>

using namespace defrec;

namespace {

ImageStatistics image(uint64_t hash, double mean = 100, double deviation = 20,
                      double saturated_share = 0) {
    return {mean, deviation, saturated_share, hash, 0};
}

// Frames that differ from each other, in steps of 33 ms.
struct Stream {
    StreamCheck check;
    uint64_t frame = 0;
    int64_t time = 0;

    uint32_t next(int64_t step = 33) {
        time += step;
        const uint64_t hash = 10 * frame++;
        return check.check(time, image(hash), image(hash + 1)).reasons;
    }
};

}  // namespace

TEST_CASE("exposure of either view is a reason; a dark one beside a bright one is one more") {
    const auto reasons = [](const ImageStatistics& left, const ImageStatistics& right) {
        return StreamCheck().check(1, left, right).reasons;
    };
    const ImageStatistics good = image(1), dark = image(2, 1, 0), white = image(3, 255, 0, 1),
                          flat = image(4, 100, 0);
    CHECK(reasons(good, good) == 0);
    CHECK(reasons(dark, good) == (DEFREC_REASON_DARK | DEFREC_REASON_ONE_VIEW));
    CHECK(reasons(good, dark) == (DEFREC_REASON_DARK | DEFREC_REASON_ONE_VIEW));
    CHECK(reasons(dark, dark) == (DEFREC_REASON_DARK | DEFREC_REASON_NO_TEXTURE));
    CHECK(reasons(dark, white) ==
          (DEFREC_REASON_DARK | DEFREC_REASON_SATURATED | DEFREC_REASON_NO_TEXTURE));
    CHECK(reasons(white, good) == (DEFREC_REASON_SATURATED | DEFREC_REASON_ONE_VIEW));
    CHECK(reasons(flat, flat) == DEFREC_REASON_NO_TEXTURE);
    CHECK(reasons(flat, good) == DEFREC_REASON_ONE_VIEW);
}

TEST_CASE("a field stands still where it is as the last one of its kind") {
    StreamCheck check;
    const ImageStatistics top = image(1), bottom = image(2), other = image(3);
    CHECK(check.check(1, top, top, false).reasons == 0);
    CHECK(check.check(2, top, top, true).reasons == 0);
    CHECK(check.check(3, bottom, other, false).reasons == 0);
    CHECK(check.check(4, top, top, true).reasons == DEFREC_REASON_FROZEN);
    CHECK(check.check(5, bottom, other, false).reasons == DEFREC_REASON_FROZEN);
}

TEST_CASE("which view shows nothing, or stands still alone, is told") {
    const ImageStatistics good = image(1), dark = image(2, 1, 0), flat = image(4, 100, 0);
    for (const ImageStatistics& bad : {dark, flat}) {
        CHECK_FALSE(StreamCheck().check(1, bad, good).left.shows);
        CHECK(StreamCheck().check(1, bad, good).right.shows);
        CHECK(StreamCheck().check(1, good, bad).left.shows);
        CHECK_FALSE(StreamCheck().check(1, good, bad).right.shows);
    }
    CHECK(StreamCheck().check(1, flat, flat).left.shows);
    StreamCheck check;
    check.check(1, image(1), image(2));
    CHECK(check.check(2, image(1), image(3)).left.is_frozen_alone);
    CHECK(check.check(3, image(4), image(3)).right.is_frozen_alone);
    const auto both = check.check(4, image(4), image(3));
    CHECK_FALSE(both.left.is_frozen_alone);
    CHECK_FALSE(both.right.is_frozen_alone);
}

TEST_CASE("the views of which reasons speak are told") {
    constexpr uint32_t kLeft = DEFREC_VIEW_LEFT, kRight = DEFREC_VIEW_RIGHT;
    const auto faulty = [](const ImageStatistics& left, const ImageStatistics& right) {
        return StreamCheck().check(1, left, right).faulty_views;
    };
    const ImageStatistics good = image(1), dark = image(2, 1, 0), white = image(3, 255, 0, 1),
                          flat = image(4, 100, 0);
    CHECK(faulty(good, good) == 0);
    for (const ImageStatistics& bad : {dark, white, flat}) {
        CHECK(faulty(bad, good) == kLeft);
        CHECK(faulty(good, bad) == kRight);
        CHECK(faulty(bad, bad) == (kLeft | kRight));
    }
    CHECK(faulty(dark, white) == (kLeft | kRight));
    CHECK(faulty(flat, dark) == kRight);
    StreamCheck check;
    check.check(1, image(1), image(2));
    CHECK(check.check(2, image(1), image(3)).faulty_views == kLeft);
    CHECK(check.check(3, image(4), image(3)).faulty_views == kRight);
    CHECK(check.check(4, image(4), image(3)).faulty_views == (kLeft | kRight));
    CHECK(check.check(5, image(5), image(6, 1)).faulty_views == kRight);
    // The left one stands still, and the right one is black.
    CHECK(check.check(6, image(5), image(7, 1)).faulty_views == kRight);
}

TEST_CASE("rows of two times in either view are a reason") {
    ImageStatistics progressive = image(1), interlaced = image(2);
    progressive.row_ratio = 1;
    interlaced.row_ratio = 1.3;
    CHECK(StreamCheck().check(1, progressive, progressive).reasons == 0);
    CHECK(StreamCheck().check(1, interlaced, progressive).reasons == DEFREC_REASON_INTERLACED);
    CHECK(StreamCheck().check(1, progressive, interlaced).reasons == DEFREC_REASON_INTERLACED);
}

TEST_CASE("a stream is frozen where both views are those of the frame before") {
    StreamCheck check;
    CHECK(check.check(0, image(0), image(0)).reasons == 0);  // there is none before
    CHECK(check.check(33, image(0), image(0)).reasons == DEFREC_REASON_FROZEN);
    CHECK(check.check(66, image(1), image(2)).reasons == 0);
    CHECK(check.check(99, image(1), image(2)).reasons == DEFREC_REASON_FROZEN);
}

TEST_CASE("row 55: a stream is frozen where nearly all of both views is as in the frame before") {
    const auto reasons = [](double left_frozen, double right_frozen) {
        StreamCheck check;
        check.check(0, image(0), image(1));
        ImageStatistics left = image(2), right = image(3);
        left.frozen = left_frozen;
        right.frozen = right_frozen;
        return check.check(33, left, right).reasons;
    };
    CHECK(reasons(0, 0) == 0);
    CHECK(reasons(0.97, 0.99) == DEFREC_REASON_FROZEN);
    CHECK(reasons(0.97, 0.1) == DEFREC_REASON_VIEW_LATE);
    CHECK(reasons(0.1, 0.97) == DEFREC_REASON_VIEW_LATE);
    CHECK(reasons(0.97, 0.9) == 0);  // compression left most of both as it was
    CHECK(reasons(0.6, 0.6) == 0);
}

TEST_CASE("row 55: a view that shows nothing does not keep a stream from being frozen") {
    const ImageStatistics good = image(1);
    for (const bool is_left : {false, true}) {
        StreamCheck check;
        const auto reasons = [&](int64_t time, const ImageStatistics& dark) {
            return is_left ? check.check(time, dark, good).reasons
                           : check.check(time, good, dark).reasons;
        };
        constexpr uint32_t kAlways = DEFREC_REASON_DARK | DEFREC_REASON_ONE_VIEW;
        CHECK(reasons(0, image(2, 1)) == kAlways);
        CHECK(reasons(33, image(3, 1)) == (kAlways | DEFREC_REASON_FROZEN));
    }
    StreamCheck check;
    check.check(0, image(1, 1), image(2, 1));
    CHECK(check.check(33, image(3, 1), image(4, 1)).reasons == DEFREC_REASON_DARK);
}

TEST_CASE("row 76: where one view alone is that of the frame before, one of them is late") {
    StreamCheck check;
    CHECK(check.check(0, image(0), image(1)).reasons == 0);
    CHECK(check.check(33, image(0), image(2)).reasons == DEFREC_REASON_VIEW_LATE);
    CHECK(check.check(66, image(3), image(2)).reasons == DEFREC_REASON_VIEW_LATE);
    CHECK(check.check(99, image(4), image(5)).reasons == 0);
}

TEST_CASE("a gap is more than twice the usual time between frames") {
    Stream stream;
    for (int i = 0; i < 5; ++i) CHECK(stream.next() == 0);
    CHECK(stream.next(66) == 0);
    for (int i = 0; i < 40; ++i) stream.next();
    CHECK(stream.next(80) == DEFREC_REASON_GAP);
    CHECK(stream.next() == 0);
}

TEST_CASE(
    "a gap is told soon after a pause of ten minutes, and another rate soon is the usual one") {
    Stream stream;
    for (int i = 0; i < 5; ++i) stream.next();
    CHECK(stream.next(600'000) == DEFREC_REASON_GAP);
    for (int i = 0; i < 8; ++i) CHECK(stream.next() == 0);
    CHECK(stream.next(500) == DEFREC_REASON_GAP);

    Stream slower;
    for (int i = 0; i < 5; ++i) slower.next(3300);
    int gaps = 0;
    for (int i = 0; i < 30; ++i) gaps += slower.next(33000) != 0;
    CHECK(gaps == 6);
}

TEST_CASE(
    "the first two frames have no usual time, and steps beyond the range of timestamps are the "
    "largest") {
    StreamCheck check;
    CHECK(check.check(INT64_MIN, image(0), image(0)).reasons == 0);
    CHECK(check.check(INT64_MIN + 33, image(1), image(1)).reasons == 0);
    CHECK(check.check(INT64_MAX, image(2), image(2)).reasons == DEFREC_REASON_GAP);
}
