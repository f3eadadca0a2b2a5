// Ticks and marks of a plot.
#include "sdk/evaluation/score/plot.hpp"

#include <doctest/doctest.h>

using namespace defrec::cli;

namespace {

void check_ticks(const PlotAxis& axis, const std::vector<double>& expected) {
    const std::vector<double> ticks = ticks_of(axis);
    REQUIRE(ticks.size() == expected.size());
    for (std::size_t i = 0; i < ticks.size(); ++i) CHECK(ticks[i] == doctest::Approx(expected[i]));
}

}  // namespace

TEST_CASE("ticks are 1, 2 or 5 times a power of ten") {
    check_ticks({"", 0, 1, false}, {0, 0.2, 0.4, 0.6, 0.8, 1});
    check_ticks({"", 0, 3, false}, {0, 0.5, 1, 1.5, 2, 2.5, 3});
    check_ticks({"", 0, 4, false}, {0, 1, 2, 3, 4});
    check_ticks({"", 0.3, 70, false}, {20, 40, 60});
    check_ticks({"", 0.05, 2, true}, {0.05, 0.1, 0.2, 0.5, 1, 2});
    check_ticks({"", 0.02, 50, true}, {0.1, 1, 10});
}

TEST_CASE("marks stand where the axes put them, and text is no markup") {
    const std::string svg = plot_svg({"a < b",
                                      {"x", 0.1, 10, true},
                                      {"y & z", 0, 2, false},
                                      {{"tracked", {{0.1, 0}, {1, 1}, {10, 2}}, {"p", "q", "r"}}}});
    // The area inside of the axes is 292 wide and 264 high.
    CHECK(svg.find("<g class=\"tracked\"><path d=\"M0.0 264.0L146.0 132.0L292.0 0.0\"/>") !=
          std::string::npos);
    CHECK(svg.find("<circle cx=\"146.0\" cy=\"132.0\" r=\"4\"><title>q</title>") !=
          std::string::npos);
    CHECK(svg.find("<title>a &lt; b</title>") != std::string::npos);
    CHECK(svg.find("y &amp; z") != std::string::npos);
}
