// Sparsification against numbers worked out by hand.
#include "sdk/evaluation/score/sparsification.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace defrec::cli;

namespace {

void check_curve(const std::vector<double>& curve, const std::vector<double>& expected) {
    REQUIRE(curve.size() == expected.size());
    for (std::size_t i = 0; i < curve.size(); ++i) CHECK(curve[i] == doctest::Approx(expected[i]));
}

}  // namespace

TEST_CASE("the right order has no area") {
    const Sparsification curves = sparsification_of({{3, 0.3}, {1, 0.1}, {6, 0.6}, {2, 0.2}});
    // The mean error is 3; without 6 it is 2, without 3 it is 1.5, then 1.
    check_curve(curves.by_true, {1, 2.0 / 3, 0.5, 1.0 / 3});
    check_curve(curves.by_expected, curves.by_true);
    CHECK(ause_of(curves) == doctest::Approx(0));
}

TEST_CASE("the wrong order has the area between the curves") {
    const Sparsification curves = sparsification_of({{3, 0.2}, {1, 0.6}, {6, 0.1}, {2, 0.3}});
    // Without 1: 11 / 3, without 2: 4.5, then 6.
    check_curve(curves.by_expected, {1, 11.0 / 9, 1.5, 2});
    // 0 + 5/9 + 1 + 5/3 over 4
    CHECK(ause_of(curves) == doctest::Approx(29.0 / 36));
}

TEST_CASE("samples with the same expected error are removed in no order") {
    const double none = std::numeric_limits<double>::quiet_NaN();
    const Sparsification curves =
        sparsification_of({{0, 0.5}, {9, none}, {1, 0.1}, {4, 0.5}, {2, 0.5}, {3, 0.1}});
    // Errors 1 and 3 are left as 2, errors 0, 4 and 2 as 2: nothing is told apart.
    check_curve(curves.by_expected, {1, 1, 1, 1, 1});
    // Mean 2; 0, 1, 2, 3 have 1.5; 0, 1, 2 have 1; 0, 1 have 0.5; 0.
    check_curve(curves.by_true, {1, 0.75, 0.5, 0.25, 0});
    CHECK(ause_of(curves) == doctest::Approx(0.5));
}

TEST_CASE("without errors there is no area, and without samples no answer") {
    CHECK(ause_of(sparsification_of({{0, 0.1}, {0, 0.2}})) == 0);
    CHECK(std::isnan(ause_of(sparsification_of({}))));
}
