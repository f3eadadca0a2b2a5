// Coverage against numbers worked out by hand.
#include "sdk/evaluation/score/coverage.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

using namespace defrec::cli;

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// `counts` samples within 1, from 1 to 2, from 2 to 3, and beyond 3 expected errors.
std::vector<ErrorSample> samples_of(const int (&counts)[4]) {
    std::vector<ErrorSample> samples;
    for (int k = 0; k < 4; ++k) {
        for (int i = 0; i < counts[k]; ++i) samples.push_back({0.1 * (k + 0.5), 0.1});
    }
    return samples;
}

std::vector<std::string> judged(const int (&counts)[4]) {
    return miscalibrated({{"tracked", coverage_of(samples_of(counts)), 0}});
}

}  // namespace

TEST_CASE("the coverage of ten samples") {
    // Ratios 0, 0.5, 1, 1, 1.5, 2, 2.5, 3, 4, 0 / 0.
    std::vector<ErrorSample> samples{{0, 0.5}, {0.25, 0.5}, {0.5, 0.5}, {2, 2}, {3, 2},
                                     {4, 2},   {5, 2},      {6, 2},     {8, 2}, {0, 0}};
    samples.push_back({1, kNone});
    const Coverage coverage = coverage_of(samples);
    CHECK(coverage.count == 10);
    CHECK(coverage.without_expected == 1);
    CHECK(coverage.within[0] == doctest::Approx(0.5));
    CHECK(coverage.within[1] == doctest::Approx(0.7));
    CHECK(coverage.within[2] == doctest::Approx(0.9));
    // 0.25 + 1 + 1 + 2.25 + 4 + 6.25 + 9 + 16 = 39.75
    CHECK(coverage.rms_ratio == doctest::Approx(std::sqrt(3.975)));
    CHECK(coverage.p99_ratio == doctest::Approx(3.91));  // rank 8.91, between 3 and 4
}

TEST_CASE("an error where none was expected is within no multiple of it") {
    const Coverage coverage = coverage_of({{0.1, 0}});
    CHECK(coverage.within[2] == 0);
    CHECK(std::isinf(coverage.p99_ratio));
    CHECK(coverage_json(coverage).dump().find("\"p99_ratio\":null") != std::string::npos);
    CHECK(std::isnan(coverage_of({}).within[0]));
}

TEST_CASE("each band is judged at its limit") {
    CHECK(judged({550, 380, 55, 15}).empty());
    CHECK(judged({549, 381, 55, 15}) ==
          std::vector<std::string>{
              "of the tracked points 54.90 % are within 1, 93.00 % within 2 and 98.50 % within 3 "
              "expected errors, asked were at least 55.00 %, 93.00 % and 98.50 %"});
    CHECK(judged({550, 379, 56, 15}).size() == 1);
    CHECK(judged({550, 380, 54, 16}).size() == 1);
}

TEST_CASE("expected errors that are too small are warned of, too large ones are no failure") {
    const auto lines = [](const int(&counts)[4]) {
        return judgement_lines({{"tracked", coverage_of(samples_of(counts)), 0}});
    };
    CHECK(lines({549, 381, 55, 15}) ==
          "WARNING. expected errors of tracked points are too small: 54.90 % are within 1, 93.00 % "
          "within 2 and 98.50 % within 3 of them, and at least 55.00 %, 93.00 % and 98.50 % should "
          "be\n");
    CHECK(lines({850, 80, 55, 15}) == "");
    CHECK(lines({851, 79, 55, 15}) ==
          "expected errors of tracked points are too large, which is safe: 85.10 % are within 1, "
          "more than 85.00 %\n");
    CHECK(judged({851, 79, 55, 15}).empty());
    // Too many far off count more than many near.
    CHECK(lines({900, 80, 4, 16}).find("WARNING") == 0);
    CHECK(judged({900, 80, 4, 16}).size() == 1);
    CHECK(lines({99, 0, 0, 0}) == "");
    const auto word = [](const int(&counts)[4]) {
        return coverage_json(coverage_of(samples_of(counts)))["judgement"];
    };
    CHECK(word({850, 80, 55, 15}) == "hold");
    CHECK(word({851, 79, 55, 15}) == "too large");
    CHECK(word({900, 80, 4, 16}) == "too small");
    CHECK(word({99, 0, 0, 0}) == "not judged");
}

TEST_CASE("few points judge nothing, and points without an expected error are faults") {
    CHECK(judged({0, 0, 0, 99}).front().find("no status has 100 points") == 0);
    CHECK(judged({0, 0, 0, 100}).size() == 1);
    const std::vector<StatusConfidence> statuses{
        {"tracked", coverage_of(samples_of({70, 30, 0, 0})), 0},
        {"extrapolated", coverage_of(samples_of({0, 0, 0, 99})), 0}};
    CHECK(miscalibrated(statuses).empty());
    std::vector<ErrorSample> samples = samples_of({70, 30, 0, 0});
    samples.push_back({0, kNone});
    CHECK(miscalibrated({{"tracked", coverage_of(samples), 0}}).front() ==
          "1 tracked points have no expected error");
}
