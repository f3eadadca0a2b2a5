// Occlusion accuracy and Jaccard against numbers worked out by hand.
#include "sdk/evaluation/score/visibility.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

using namespace defrec::cli;

TEST_CASE("one sample of each kind") {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const std::vector<VisibilitySample> samples{
        {true, true, 2, 0},   // a hit from 2 mm on
        {true, true, 5, 33},  // a hit from 8 mm on, none in px; else FP and FN
        {true, false, 0, 0},  // FN, wherever it is
        {true, false, kFar, kFar}, {false, true, 0, 0},  // FP, wherever it is
        {false, false, 0, 0},                            // not counted in Jaccard
        {false, false, kFar, kFar}};
    const Visibility visibility = visibility_of(samples, true);
    CHECK(visibility.count == 7);
    CHECK(visibility.occlusion_accuracy == doctest::Approx(4.0 / 7));
    // Below 5 mm: TP 1, FP 2, FN 3. From there: TP 2, FP 1, FN 2.
    CHECK(visibility.mm.at[0] == doctest::Approx(1.0 / 6));
    CHECK(visibility.mm.at[1] == doctest::Approx(1.0 / 6));
    for (std::size_t i = 2; i < 5; ++i) CHECK(visibility.mm.at[i] == doctest::Approx(2.0 / 5));
    CHECK(visibility.mm.average == doctest::Approx((2.0 / 6 + 6.0 / 5) / 5));
    CHECK(visibility.px->average == doctest::Approx(1.0 / 6));

    const auto json = visibility_json(visibility);
    CHECK(json["jaccard_mm"]["8"] == doctest::Approx(0.4));
    CHECK(json["jaccard_px"]["32"] == doctest::Approx(1.0 / 6));
}

TEST_CASE("nothing visible, and nothing at all") {
    const Visibility hidden = visibility_of({{false, false, 0, 0}}, false);
    CHECK(hidden.occlusion_accuracy == 1);
    CHECK(std::isnan(hidden.mm.average));
    CHECK_FALSE(hidden.px);
    CHECK(visibility_json(hidden)["jaccard_px"].is_null());
    CHECK(visibility_json(hidden)["jaccard_mm"].dump().find("\"average\":null") !=
          std::string::npos);
    CHECK(std::isnan(visibility_of({}, false).occlusion_accuracy));
}
