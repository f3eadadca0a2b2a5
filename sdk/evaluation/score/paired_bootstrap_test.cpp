// Differences of known spread.
#include "sdk/evaluation/score/paired_bootstrap.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace defrec::cli;

namespace {
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
}

TEST_CASE("clips that one of the two lacks do not count") {
    const PairedChange change = paired_change({1, kNone, 3, 4}, {2, 5, kNone, 5});
    CHECK(change.clips == 2);
    CHECK(change.mean == 1);
    CHECK(change.low == 1);  // both differ alike
    CHECK(change.high == 1);
}

TEST_CASE("a single clip says nothing of others, none says nothing") {
    CHECK(paired_change({1}, {3}).mean == 2);
    CHECK(std::isnan(paired_change({1}, {3}).low));
    CHECK(paired_change({kNone}, {3}).clips == 0);
    CHECK(std::isnan(paired_change({}, {}).mean));
}

TEST_CASE("the interval is that of the mean, however much clips differ from each other") {
    constexpr std::size_t kClips = 100;
    std::mt19937_64 random(3);
    std::normal_distribution<double> clip(0, 10), change(0.5, 1);
    std::vector<double> first, second;
    double mean = 0, squares = 0;
    for (std::size_t i = 0; i < kClips; ++i) {
        first.push_back(clip(random));
        const double by = change(random);
        second.push_back(first.back() + by);
        mean += by / kClips;
        squares += by * by / kClips;
    }
    const double error = std::sqrt((squares - mean * mean) / kClips);
    const PairedChange found = paired_change(first, second);
    CHECK(found.mean == doctest::Approx(mean));
    CHECK(found.low == doctest::Approx(mean - 1.96 * error).epsilon(0.1));
    CHECK(found.high == doctest::Approx(mean + 1.96 * error).epsilon(0.1));
    CHECK(found.low == paired_change(first, second).low);
}
