// What is kept of long sequences.
#include "sdk/report/thinning.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

using defrec::cli::Distribution;
using defrec::cli::EvenlyThinned;
using defrec::cli::Series;

TEST_CASE("evenly thinned items are equidistant, begin with the first, and stay within capacity") {
    for (const int offered : {1, 7, 8, 9, 100, 1001}) {
        EvenlyThinned<int> thinned(8);
        for (int i = 0; i < offered; ++i)
            if (thinned.offer()) thinned.keep(i);
        const auto& items = thinned.items();
        REQUIRE(items.size() <= 8);
        CHECK(items.size() >= std::min<std::size_t>(4, static_cast<std::size_t>(offered)));
        CHECK(items.front() == 0);
        for (std::size_t i = 1; i < items.size(); ++i)
            CHECK(items[i] - items[i - 1] == static_cast<int>(thinned.stride()));
        CHECK(offered - items.back() <= static_cast<int>(thinned.stride()));
    }
}

TEST_CASE("an item that is kept knows of those that are left out after it") {
    const auto larger = [](int& kept, int left_out) { kept = std::max(kept, left_out); };
    for (const int largest : {0, 1, 6, 7, 8, 500, 1000}) {
        EvenlyThinned<int> thinned(8);
        for (int i = 0; i <= 1000; ++i) {
            const int value = i == largest ? 9 : 1;
            if (thinned.offer())
                thinned.keep(value, larger);
            else
                thinned.add_to_last(value, larger);
        }
        const auto& items = thinned.items();
        CHECK(std::count(items.begin(), items.end(), 9) == 1);
        const auto at = static_cast<std::size_t>(largest) / thinned.stride();
        CHECK(items[at] == 9);
    }
}

TEST_CASE("quantiles are within half a per cent of the sorted sample's") {
    std::mt19937 random(3);
    std::lognormal_distribution<double> draw(1.5, 1.0);
    Distribution distribution;
    std::vector<double> sample(5001);
    for (double& value : sample) distribution.add(value = draw(random));
    distribution.add(std::nan(""));
    std::sort(sample.begin(), sample.end());
    CHECK(distribution.count() == 5001);
    CHECK(distribution.quantile(0.5) == doctest::Approx(sample[2500]).epsilon(0.0075));
    CHECK(distribution.quantile(0.99) == doctest::Approx(sample[4950]).epsilon(0.01));
    CHECK(std::isnan(Distribution().quantile(0.5)));
}

TEST_CASE("extreme values are clamped, not lost") {
    Distribution distribution;
    for (const double value : {0.0, -3.0, 1e30}) distribution.add(value);
    CHECK(distribution.count() == 3);
    CHECK(distribution.quantile(0.9) > 9e5);
}

TEST_CASE("merged samples keep the worst of their frames") {
    Series series(4);
    const std::size_t high = series.line("residual", Series::Worst::largest);
    const std::size_t low = series.line("inliers", Series::Worst::smallest);
    for (int i = 0; i < 16; ++i) {
        series.begin(i, 10.0 * i);
        series.set(high, i == 5 ? 99 : 1);
        series.set(low, i == 10 ? -7 : 50);
    }
    REQUIRE(series.frames().size() == 4);
    CHECK(series.stride() == 4);
    CHECK(series.frames() == std::vector<std::int64_t>{0, 4, 8, 12});
    CHECK(series.timestamps_ms()[3] == 120);
    CHECK(series.lines()[high].values == std::vector<float>{1, 99, 1, 1});
    CHECK(series.lines()[low].values == std::vector<float>{50, 50, -7, 50});
}

TEST_CASE("a line that comes up late is unknown before") {
    Series series(8);
    series.begin(0, 0);
    series.begin(1, 1);
    series.set(series.line("lm", Series::Worst::largest), 3);
    CHECK(std::isnan(series.lines()[0].values[0]));
    CHECK(series.lines()[0].values[1] == 3);
    series.begin(2, 2);
    CHECK(std::isnan(series.lines()[0].values[2]));
}
