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
