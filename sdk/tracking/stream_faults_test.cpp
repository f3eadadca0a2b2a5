// Streams that freeze, repeat, lag, skip or turn back in time, given to the tracker through the C
// API.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "sdk/tracking/test_pair_session.hpp"

using namespace defrec::test;
using Session = PairSession;

TEST_CASE("row 55: a frozen stream is named, and followed all the same") {
    Session session;
    const Pair pair = render(0, 0);
    CHECK((session.track(pair).reasons & DEFREC_REASON_FROZEN) == 0);
    const Session::Frame again = session.track(pair);
    CHECK((again.reasons & DEFREC_REASON_FROZEN) != 0);
    CHECK(again.state == DEFREC_TRACKING);
}

TEST_CASE("row 55: a clock in the picture does not hide that the stream is frozen") {
    Session session;
    Pair pair = render(0, 0);
    session.track(pair);
    for (int i = 1; i <= 3; ++i) {
        for (int view = 0; view < 2; ++view)
            for (int y = 4; y < 12; ++y)
                for (int x = 4; x < 28; ++x)
                    (view == 0 ? pair.left : pair.right)[static_cast<size_t>(y * kWidth + x)] =
                        static_cast<uint8_t>(40 * ((x + y * i) % 5));
        CHECK((session.track(pair).reasons & DEFREC_REASON_FROZEN) != 0);
    }
}

TEST_CASE("row 55: from the third repeated frame on nothing is seen, until the stream goes on") {
    Session session;
    const Pair pair = render(0, 0);
    const Session::Frame first = session.track(pair);
    for (int repeated = 1; repeated <= 5; ++repeated) {
        CAPTURE(repeated);
        const Session::Frame frame = session.track(pair);
        CHECK((frame.reasons & DEFREC_REASON_FROZEN) != 0);
        CHECK(frame.state == (repeated < 3 ? DEFREC_TRACKING : DEFREC_DEGRADED));
        const auto observed =
            std::count(frame.status.begin(), frame.status.end(), DEFREC_POINT_OBSERVED);
        CHECK((observed > 0) == (repeated < 3));
        if (repeated >= 3) CHECK(frame.largest_error > first.largest_error);
    }
    const Session::Frame next = session.track(render(0.5, 0));
    CHECK(next.state == DEFREC_TRACKING);
    CHECK(next.epoch == first.epoch);
}

namespace {

// A picture is believed until it has been repeated for the third time. shown: how often it has.
void check_trust(const Session::Frame& frame, int shown) {
    const auto unknown = std::count(frame.status.begin(), frame.status.end(), DEFREC_POINT_UNKNOWN);
    if (shown < 3)
        CHECK(2 * unknown < std::ssize(frame.status));
    else
        CHECK(unknown == std::ssize(frame.status));
}

// A right view that shows nothing: black, or a dark sensor's noise.
std::vector<uint8_t> dark_view(int most, uint64_t seed) {
    std::vector<uint8_t> gray(size_t{kWidth} * kHeight);
    for (size_t i = 0; i < gray.size(); ++i)
        gray[i] = static_cast<uint8_t>(
            std::lround((hash_noise(static_cast<int64_t>(i), 0, seed) + 0.5) * most));
    return gray;
}

// The rows of both views are of two times.
Pair interlaced_pair(double from, double to) {
    Pair pair = render(to, 0);
    const Pair before = render(from, 0);
    for (int y = 1; y < kHeight; y += 2) {
        std::copy_n(before.left.begin() + y * kWidth, kWidth, pair.left.begin() + y * kWidth);
        std::copy_n(before.right.begin() + y * kWidth, kWidth, pair.right.begin() + y * kWidth);
    }
    return pair;
}

}  // namespace

TEST_CASE("row 55: a left view that freezes beside one that shows nothing is not believed") {
    for (const int noise : {0, 4}) {
        CAPTURE(noise);
        Session session;
        for (int i = 0; i < 3; ++i) session.track(render(0.3 * i, 0));
        Pair pair = render(0.9, 0);
        for (int shown = 0; shown < 5; ++shown) {
            CAPTURE(shown);
            pair.right = dark_view(noise, static_cast<uint64_t>(shown));
            const Session::Frame frame = session.track(pair);
            CHECK(frame.state == DEFREC_DEGRADED);
            CHECK((frame.reasons & DEFREC_REASON_ONE_VIEW) != 0);
            CHECK(frame.faulty_views == DEFREC_VIEW_RIGHT);
            CHECK(((frame.reasons & DEFREC_REASON_FROZEN) != 0) == (shown > 0));
            check_trust(frame, shown);
        }
    }
}

TEST_CASE("row 55: a pair of interlaced images that freezes is not believed") {
    Session session;
    for (int i = 0; i < 3; ++i) session.track(render(0.3 * i, 0));
    const Pair pair = interlaced_pair(0.6, 1.6);
    for (int shown = 0; shown < 5; ++shown) {
        CAPTURE(shown);
        const Session::Frame frame = session.track(pair);
        CHECK(frame.state == DEFREC_DEGRADED);
        CHECK((frame.reasons & DEFREC_REASON_INTERLACED) != 0);
        CHECK(((frame.reasons & DEFREC_REASON_FROZEN) != 0) == (shown > 0));
        check_trust(frame, shown);
    }
}

TEST_CASE("row 55: a part of the left view that stands is seen beside a black right view") {
    constexpr int kEdge = kWidth * 3 / 8;
    const Pair first = render(0, 0);
    Session whole, session;
    for (Session* each : {&whole, &session}) each->track(first);
    for (int i = 1; i <= 4; ++i) {
        CAPTURE(i);
        Pair pair = render(0.6 * i, 0);
        pair.right = dark_view(0, 0);
        const Session::Frame moving = whole.track(pair);
        CHECK((moving.reasons & DEFREC_REASON_FROZEN) == 0);
        for (int y = 0; y < kHeight; ++y)
            std::copy_n(&first.left[static_cast<size_t>(y * kWidth)], kEdge,
                        &pair.left[static_cast<size_t>(y * kWidth)]);
        const Session::Frame frame = session.track(pair);
        CHECK((frame.reasons & DEFREC_REASON_FROZEN) != 0);
        CHECK(frame.state == DEFREC_DEGRADED);
        CHECK(frame.largest_error > moving.largest_error + 0.5);
    }
}

TEST_CASE("row 55: in a part of the picture that stands while the rest moves on nothing is seen") {
    constexpr int kEdge = kWidth * 3 / 8;
    const Pair first = render(0, 0);
    const auto frozen_part = [&](Pair pair) {
        for (int y = 0; y < kHeight; ++y) {
            std::copy_n(&first.left[static_cast<size_t>(y * kWidth)], kEdge,
                        &pair.left[static_cast<size_t>(y * kWidth)]);
            std::copy_n(&first.right[static_cast<size_t>(y * kWidth)], kEdge,
                        &pair.right[static_cast<size_t>(y * kWidth)]);
        }
        return pair;
    };
    Session session;
    session.track(first);
    for (int i = 1; i <= 4; ++i) {
        CAPTURE(i);
        const Session::Frame frame = session.track(frozen_part(render(0.6 * i, 0)));
        CHECK((frame.reasons & DEFREC_REASON_FROZEN) != 0);
        CHECK(frame.faulty_views == (DEFREC_VIEW_LEFT | DEFREC_VIEW_RIGHT));
        CHECK(frame.state == DEFREC_DEGRADED);
        int observed_there = 0, observed_elsewhere = 0;
        for (size_t v = 0; v < frame.status.size(); ++v) {
            const float* at = &frame.vertices[3 * v];
            const double u = kFocal * at[0] / at[2] + kWidth / 2.0;
            if (frame.status[v] != DEFREC_POINT_OBSERVED) continue;
            observed_there += u < kEdge - 32;
            observed_elsewhere += u > kEdge + 32;
        }
        CHECK(observed_there == 0);
        CHECK(observed_elsewhere > 0);
    }
    const Session::Frame whole = session.track(render(2.7, 0));
    CHECK(whole.state == DEFREC_TRACKING);
    CHECK((whole.reasons & DEFREC_REASON_FROZEN) == 0);
}

TEST_CASE("row 111: both views zoomed from one frame to the next") {
    const auto zoom = [](const Pair& pair, double factor) {
        Pair zoomed = pair;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const double u = kWidth / 2 + (x - kWidth / 2) / factor,
                             v = kHeight / 2 + (y - kHeight / 2) / factor;
                const int left = static_cast<int>(u), top = static_cast<int>(v);
                const double right_share = u - left, lower_share = v - top;
                const auto at = [&](const std::vector<uint8_t>& gray) {
                    const uint8_t* p = &gray[static_cast<size_t>(
                        std::min(top, kHeight - 2) * kWidth + std::min(left, kWidth - 2))];
                    return static_cast<uint8_t>(std::lround(
                        (1 - lower_share) * ((1 - right_share) * p[0] + right_share * p[1]) +
                        lower_share *
                            ((1 - right_share) * p[kWidth] + right_share * p[kWidth + 1])));
                };
                const auto pixel = static_cast<size_t>(y * kWidth + x);
                zoomed.left[pixel] = at(pair.left);
                zoomed.right[pixel] = at(pair.right);
            }
        return zoomed;
    };
    Session session;
    for (int i = 0; i < 4; ++i)
        CHECK((session.track(render(0.1 * i, 0)).reasons & DEFREC_REASON_CALIBRATION) == 0);
    for (int i = 4; i < 10; ++i) {
        CAPTURE(i);
        const Session::Frame frame = session.track(zoom(render(0.1 * i, 0), 1.1));
        CHECK((frame.reasons & DEFREC_REASON_CALIBRATION) != 0);
        CHECK(frame.state == DEFREC_DEGRADED);
        CHECK(std::abs(frame.shift[2]) < 2 * frame.largest_error);
        CHECK(std::count(frame.status.begin(), frame.status.end(), DEFREC_POINT_OBSERVED) == 0);
    }
    CHECK((session.track(render(1, 0)).reasons & DEFREC_REASON_CALIBRATION) == 0);
}

TEST_CASE("row 76: a repeated frame says nothing of a lag") {
    Session session;
    for (int i = 0; i < 6; ++i) {
        CAPTURE(i);
        const Pair pair = render(0.4 * i, 0.7 * i);
        CHECK((session.track(pair).reasons & DEFREC_REASON_VIEW_LATE) == 0);
        CHECK((session.track(pair).reasons & DEFREC_REASON_VIEW_LATE) == 0);
    }
}

TEST_CASE("row 107: a view that stays late is late in a repeated frame, and in none of one view") {
    const auto at = [](int time) { return render(0.1 * time, 1.2 * std::sin(0.5 * time)); };
    Session session;
    session.track(at(0));
    for (int i = 1; i <= 16; ++i) {
        CAPTURE(i);
        const Pair pair{at(i).left, at(i - 1).right};
        const Session::Frame late = session.track(pair);
        if (i < 12) continue;
        CHECK((late.reasons & DEFREC_REASON_VIEW_LATE) != 0);
        CHECK(late.faulty_views == 0);
        for (int repeated = 1; repeated <= 2; ++repeated) {
            const Session::Frame again = session.track(pair);
            CHECK((again.reasons & DEFREC_REASON_FROZEN) != 0);
            CHECK((again.reasons & DEFREC_REASON_VIEW_LATE) != 0);
            CHECK(again.state == DEFREC_DEGRADED);
            CHECK(std::abs(again.shift[2] - late.shift[2]) < 0.3);
        }
    }
    Pair pair = at(17);
    pair.right.assign(pair.right.size(), 0);
    const uint32_t reasons = session.track(pair).reasons;
    CHECK((reasons & DEFREC_REASON_ONE_VIEW) != 0);
    CHECK((reasons & DEFREC_REASON_VIEW_LATE) == 0);
}

TEST_CASE("row 76: of a view that stands still nothing is believed, and no template made") {
    Session session;
    const Pair first = render(0, 0);
    session.track(first);
    for (int i = 1; i <= 4; ++i) {
        CAPTURE(i);
        Pair pair = render(1.5 * i, 0);
        pair.right = first.right;
        const Session::Frame frame =
            session.track(pair, nullptr, i == 3 ? uint32_t{DEFREC_FRAME_CAPTURE_TEMPLATE} : 0);
        CHECK((frame.reasons & DEFREC_REASON_VIEW_LATE) != 0);
        CHECK(frame.faulty_views == DEFREC_VIEW_RIGHT);
        CHECK((frame.state == DEFREC_DEGRADED || frame.state == DEFREC_LOST));
        CHECK(frame.epoch == 1);
        CHECK(std::abs(frame.shift[2]) < 1.5);  // 1.5 mm to the side would be 8 mm of depth
    }
    Session other;
    other.track(Pair{std::vector<uint8_t>(first.left.size()), first.right});
    const Session::Frame still = other.track(first);
    CHECK((still.reasons & DEFREC_REASON_VIEW_LATE) != 0);
    CHECK(still.state == DEFREC_INITIALISING);
    CHECK(other.track(render(0.5, 0)).state == DEFREC_TRACKING);
}

TEST_CASE("of a view whose rows are of two times no depth is believed, and no template made") {
    const auto interlaced = [](double from, double to) {
        Pair pair = render(to, 0);
        const Pair before = render(from, 0);
        for (int y = 1; y < kHeight; y += 2)
            std::copy_n(before.right.begin() + y * kWidth, kWidth, pair.right.begin() + y * kWidth);
        return pair;
    };
    Session session;
    session.track(render(0, 0));
    const Session::Frame frame =
        session.track(interlaced(0, 1), nullptr, DEFREC_FRAME_CAPTURE_TEMPLATE);
    CHECK((frame.reasons & DEFREC_REASON_INTERLACED) != 0);
    CHECK((frame.state == DEFREC_DEGRADED || frame.state == DEFREC_LOST));
    CHECK(frame.epoch == 1);
    CHECK(session.track(render(1, 0)).state == DEFREC_TRACKING);

    Session other;
    const Session::Frame first = other.track(interlaced(0, 1));
    CHECK((first.reasons & DEFREC_REASON_INTERLACED) != 0);
    CHECK(first.state == DEFREC_INITIALISING);
    const Session::Frame second = other.track(render(0.5, 0));
    CHECK((second.reasons & DEFREC_REASON_INTERLACED) == 0);
    CHECK(second.state == DEFREC_TRACKING);
}

TEST_CASE("row 52: a frame that comes twice is named or refused, and the stream goes on") {
    Session session;
    for (int i = 0; i < 4; ++i) session.track(render(0.3 * i, 0));
    const Pair pair = render(1.2, 0);
    const Session::Frame first = session.track(pair);
    // With its own timestamp again.
    session.time -= 33000000;
    defrec_job job = nullptr;
    CHECK(session.submit(pair, &job) == DEFREC_ERROR_ARGUMENT);
    CHECK(job == nullptr);
    CHECK(std::string(defrec_last_error()).find("timestamp") != std::string::npos);
    // With a later one.
    const Session::Frame second = session.track(pair);
    CHECK(second.state == DEFREC_TRACKING);
    CHECK((second.reasons & DEFREC_REASON_FROZEN) != 0);
    CHECK(second.epoch == first.epoch);
    CHECK(std::abs(second.shift[0] - first.shift[0]) < 0.1);
    const Session::Frame next = session.track(render(1.5, 0));
    CHECK(next.state == DEFREC_TRACKING);
    CHECK((next.reasons & (DEFREC_REASON_FROZEN | DEFREC_REASON_GAP)) == 0);
    CHECK(std::abs(next.shift[0] - 1.5) < 0.15);
}

TEST_CASE("row 51: a gap in the stream is named") {
    Session session;
    for (int i = 0; i < 4; ++i)
        CHECK((session.track(render(0.1 * i, 0)).reasons & DEFREC_REASON_GAP) == 0);
    session.time += 10 * 33000000;
    CHECK((session.track(render(0.5, 0)).reasons & DEFREC_REASON_GAP) != 0);
}

TEST_CASE("row 91: timestamps as far apart as there are") {
    Session session;
    session.time = INT64_MIN;  // and a frame's time later
    for (int i = 0; i < 3; ++i)
        CHECK((session.track(render(0.1 * i, 0)).reasons & DEFREC_REASON_GAP) == 0);
    const int64_t before = session.time;
    for (const int64_t time : {INT64_MAX, INT64_MAX - int64_t{48} * 3600 * 1000000000}) {
        session.time = time - 33000000;
        defrec_job job = nullptr;
        CHECK(session.submit(render(0.3, 0), &job) == DEFREC_ERROR_ARGUMENT);
        CHECK(std::string(defrec_last_error()).find("timestamp_ns") != std::string::npos);
    }
    const Session::Frame confirmed = session.track(render(0.3, 0));
    CHECK((confirmed.reasons & DEFREC_REASON_GAP) != 0);
    CHECK(usable(confirmed.state));
    CHECK(session.time > before);
}

TEST_CASE("row 53: a timestamp that does not grow is refused and changes nothing") {
    Session session;
    session.track(render(0, 0));
    session.time -= 33000000;
    defrec_job job = nullptr;
    CHECK(session.submit(render(0, 0), &job) == DEFREC_ERROR_ARGUMENT);
    CHECK(job == nullptr);
    CHECK(std::string(defrec_last_error()).find("timestamp") != std::string::npos);
    CHECK(session.track(render(0.1, 0)).state == DEFREC_TRACKING);
}
