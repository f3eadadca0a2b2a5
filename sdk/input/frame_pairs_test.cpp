// Pairs of images of two cameras: which images belong together, and what is counted.
#include "sdk/input/frame_pairs.hpp"

#include <doctest/doctest.h>

using namespace defrec::cli;

namespace {

constexpr auto kLeft = FramePairs::View::kLeft;
constexpr auto kRight = FramePairs::View::kRight;

CameraImage at(double time_ms) {
    CameraImage image;
    image.time_ms = time_ms;
    return image;
}

FramePairs pairs_within(double tolerance_ms) {
    FramePairs pairs;
    pairs.set_tolerance(tolerance_ms);
    return pairs;
}

}  // namespace

TEST_CASE("images of one time make a pair, whichever comes first") {
    FramePairs pairs = pairs_within(10);
    pairs.add(kLeft, at(100));
    CHECK_FALSE(pairs.take());
    pairs.add(kRight, at(104));
    const auto first = pairs.take();
    REQUIRE(first);
    CHECK(first->left.time_ms == 100);
    CHECK(first->right.time_ms == 104);
    CHECK_FALSE(pairs.take());

    pairs.add(kRight, at(133));
    pairs.add(kLeft, at(131));
    const auto second = pairs.take();
    REQUIRE(second);
    CHECK(second->left.time_ms == 131);
    CHECK(second->right.time_ms == 133);
    CHECK(pairs.counts().pairs == 2);
    CHECK(pairs.counts().dropped == 0);
    CHECK(pairs.counts().unpaired == 0);
    CHECK(pairs.counts().difference_sum_ms == 6);
}

TEST_CASE("the partner is the image nearest in time") {
    FramePairs pairs = pairs_within(10);
    pairs.add(kRight, at(92));
    pairs.add(kRight, at(99));
    pairs.add(kRight, at(107));
    pairs.add(kLeft, at(100));
    const auto pair = pairs.take();
    REQUIRE(pair);
    CHECK(pair->right.time_ms == 99);
    CHECK(pairs.counts().unpaired == 1);
    // The newer one still waits for its own partner.
    pairs.add(kLeft, at(110));
    CHECK(pairs.take()->right.time_ms == 107);
}

TEST_CASE("images too far apart are no pair, and are counted once nobody can want them") {
    FramePairs pairs = pairs_within(10);
    for (int i = 0; i < 6; ++i) pairs.add(kLeft, at(100 + 33 * i));
    CHECK_FALSE(pairs.take());
    CHECK(pairs.counts().unpaired == 2);
    pairs.add(kRight, at(100 + 33 * 5 + 11));
    CHECK_FALSE(pairs.take());
    pairs.add(kRight, at(100 + 33 * 5));
    CHECK(pairs.take());
    CHECK(pairs.counts().unpaired == 6);
    CHECK(pairs.counts().pairs == 1);
}

TEST_CASE("of pairs that nobody took only the newest is left") {
    FramePairs pairs = pairs_within(10);
    for (int i = 0; i < 5; ++i) {
        pairs.add(kLeft, at(33 * i));
        pairs.add(kRight, at(33 * i));
    }
    CHECK(pairs.take()->left.time_ms == 33 * 4);
    CHECK(pairs.counts().pairs == 5);
    CHECK(pairs.counts().dropped == 4);
}

TEST_CASE("what waits can be forgotten") {
    FramePairs pairs = pairs_within(10);
    pairs.add_pair({at(1), at(1)});
    pairs.add(kLeft, at(50));
    pairs.clear();
    CHECK_FALSE(pairs.take());
    pairs.add(kRight, at(50));
    CHECK_FALSE(pairs.take());
    CHECK(pairs.counts().pairs == 1);
}

TEST_CASE("at the end those that wait have no partner") {
    FramePairs pairs = pairs_within(10);
    pairs.add(kLeft, at(0));
    pairs.add(kLeft, at(40));
    pairs.add(kRight, at(80));
    CHECK(pairs.counts().unpaired == 0);
    pairs.end();
    CHECK(pairs.counts().unpaired == 3);
    pairs.end();
    CHECK(pairs.counts().unpaired == 3);
}
