// The start-up test of a device: it passes, and each kind of wrong answer is named.
#include "backends/vulkan/known_answer.hpp"

#include <doctest/doctest.h>

#include "backends/vulkan/test_device.hpp"

using namespace defrec;
using namespace defrec::vulkan;

TEST_CASE("row 48: a device that computes as the definition says passes the start-up test") {
    if (!under_test::available()) return;
    CHECK(difference(expected_answers(), computed_answers(under_test::device())) == "");
    check_known_answers(under_test::device());
}

TEST_CASE("packed dot products are what the start-up test expects") {
    CHECK(expected_packed_dots()[3 * 3] == 4 * 128 * 128);
    CHECK(expected_packed_dots()[3 * 3 + 2] == -4 * 128 * 127);
    if (!under_test::available() || !under_test::device().physical().packed_dot) return;
    CHECK(computed_packed_dots(under_test::device()) == expected_packed_dots());
}

TEST_CASE("a logical device whose packed dot products are wrong counts as one without") {
    if (!under_test::available()) return;
    const auto logical = under_test::new_logical_device();
    CHECK(logical->packed_dot() == logical->physical().packed_dot);
    logical->distrust_packed_dot();
    CHECK(!logical->packed_dot());
    CHECK(!Device(logical).wide());
}

TEST_CASE("row 48: every wrong answer is found, and its kind named") {
    const KnownAnswers right = expected_answers();
    CHECK(difference(right, right) == "");
    KnownAnswers wrong = right;
    wrong.words[8 * 17] ^= 1;
    CHECK(difference(right, wrong) == "1 of 4096 wrong in products and sums of floats");
    wrong.words[8 * 5 + 7] ^= 0x80000000u;
    wrong.words[8 * 6 + 7] ^= 1;
    CHECK(difference(right, wrong) ==
          "1 of 4096 wrong in products and sums of floats, 2 of 4096 wrong in loops");
    wrong = right;
    wrong.bytes[4095] ^= 1;
    wrong.shorts[0] = int16_t(wrong.shorts[0] + 1);
    CHECK(difference(right, wrong) == "2 of 4096 wrong in bytes and shorts in memory");
}
