#include "sdk/report/picture_gaps.hpp"

#include <doctest/doctest.h>

using defrec::cli::PictureGaps;

TEST_CASE("times without a picture are those before a frame with that reason, a second or more") {
    PictureGaps gaps;
    gaps.add(0, "gap");
    gaps.add(5000, "");  // usual there
    gaps.add(25000, "few-matches, gap");
    gaps.add(25040, "");
    gaps.add(25140, "gap");
    CHECK(gaps.count() == 1);
    CHECK(gaps.total_ms() == 20000);
    REQUIRE(gaps.listed().size() == 1);
    CHECK(gaps.listed()[0].from_ms == 5000);
    CHECK(gaps.listed()[0].to_ms == 25000);
}

TEST_CASE("of many the first are listed, and all are counted") {
    PictureGaps gaps;
    for (int i = 0; i <= 80; ++i) gaps.add(2000.0 * i, "gap");
    CHECK(gaps.count() == 80);
    CHECK(gaps.total_ms() == 160000);
    CHECK(gaps.listed().size() == PictureGaps::kListed);
}
