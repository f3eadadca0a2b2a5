// First frames that show too little for a template, given to the tracker through the C API.
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "sdk/tracking/test_pair_session.hpp"

using namespace defrec::test;
using Session = PairSession;

namespace {

// Three passes of a box of 2 radius + 1 px: nearly a Gaussian of sigma radius + 0.5.
std::vector<uint8_t> blurred(std::vector<uint8_t> image, int radius) {
    for (int pass = 0; pass < 6; ++pass) {
        const std::vector<uint8_t> from = image;
        const int dx = pass % 2, dy = 1 - dx;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                int sum = 0;
                for (int i = -radius; i <= radius; ++i) {
                    const int u = std::clamp(x + i * dx, 0, kWidth - 1),
                              v = std::clamp(y + i * dy, 0, kHeight - 1);
                    sum += from[static_cast<size_t>(v * kWidth + u)];
                }
                image[static_cast<size_t>(y * kWidth + x)] =
                    static_cast<uint8_t>(sum / (2 * radius + 1));
            }
    }
    return image;
}

Pair blurred(const Pair& pair, int radius) {
    Pair result;
    result.left = blurred(pair.left, radius);
    result.right = blurred(pair.right, radius);
    return result;
}

}  // namespace

TEST_CASE("row 150: a frame that cannot track itself gives no template, whatever its blur") {
    for (const int radius : {8, 12, 24}) {
        CAPTURE(radius);
        Session session;
        for (int i = 0; i < 5; ++i) {
            const Session::Frame frame = session.track(blurred(render(0.3 * i, 0), radius));
            CHECK(frame.state == DEFREC_INITIALISING);
            CHECK(frame.reasons != 0);
            CHECK(frame.epoch == 0);
            CHECK(frame.vertices.empty());
        }
        const Session::Frame first = session.track(render(1.5, 0));
        CHECK(first.state == DEFREC_TRACKING);
        CHECK(first.epoch == 1);
        CHECK(session.track(render(1.8, 0)).state == DEFREC_TRACKING);
    }
}

TEST_CASE("row 150: a template that good frames do not show is given up, and captured again") {
    Session session;
    const Session::Frame other = session.track(render(200, 100));
    REQUIRE(other.state == DEFREC_TRACKING);
    std::vector<uint32_t> states;
    std::vector<uint32_t> epochs;
    for (int i = 0; i < 5; ++i) {
        const Session::Frame frame = session.track(render(0.3 * i, 0));
        states.push_back(frame.state);
        epochs.push_back(frame.epoch);
    }
    CHECK(states == std::vector<uint32_t>{DEFREC_LOST, DEFREC_LOST, DEFREC_INITIALISING,
                                          DEFREC_TRACKING, DEFREC_TRACKING});
    CHECK(epochs.back() == 2);
}

TEST_CASE("a template that was asked for or set is never given up") {
    Session session;
    session.track(render(200, 100), nullptr, DEFREC_FRAME_CAPTURE_TEMPLATE);
    for (int i = 0; i < 6; ++i) CHECK(session.track(render(0.3 * i, 0)).state == DEFREC_LOST);
}
