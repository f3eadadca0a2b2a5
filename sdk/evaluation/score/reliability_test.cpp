// Reliability against numbers worked out by hand.
#include "sdk/evaluation/score/reliability.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace defrec::cli;

TEST_CASE("bins have equal counts and root mean squares") {
    const double none = std::numeric_limits<double>::quiet_NaN();
    const std::vector<ErrorSample> samples{{7, 7}, {3, 1}, {9, none}, {4, 1}, {0, 1}, {1, 1}};
    // By expected error: 1 1 | 1 1 7 would be two bins of five; five give counts 2 and 3.
    const auto bins = reliability_of(samples, 2, 2);
    REQUIRE(bins.size() == 2);
    CHECK(bins[0].count == 2);
    CHECK(bins[1].count == 3);
    CHECK(bins[0].expected_mm == doctest::Approx(1));
    CHECK(bins[1].expected_mm == doctest::Approx(std::sqrt(51.0 / 3)));

    const auto one = reliability_of(samples, 10, 3);
    REQUIRE(one.size() == 1);
    CHECK(one[0].count == 5);
    CHECK(one[0].expected_mm == doctest::Approx(std::sqrt(53.0 / 5)));
    CHECK(one[0].measured_mm == doctest::Approx(std::sqrt(75.0 / 5)));
    CHECK(reliability_of(samples, 10, 100).size() == 1);
    CHECK(reliability_of(samples, 3, 1).size() == 3);
    CHECK(reliability_of({{1, none}}, 10, 1).empty());
}
