#include "conformance/worker/tolerances.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "conformance/compare/compare.hpp"
#include "conformance/worker/case.hpp"

using namespace defrec::conformance;

namespace {
const std::string kGood =
    "warp.position:\n  unit: mm\n  maximum: 2e-4\n  p99: 1e-4\n  provenance: said so\n  command: "
    "none\n";

std::string without(const std::string& part, const std::string& instead = "") {
    std::string text = kGood;
    return text.replace(text.find(part), part.size(), instead);
}
}  // namespace

TEST_CASE("a tolerance has both limits, a unit, and says where it comes from") {
    const Tolerance one = Tolerances::parse(kGood).at("warp.position");
    CHECK(one.maximum == 2e-4);
    CHECK(one.p99 == 1e-4);
    CHECK(one.unit == "mm");
    CHECK(one.provenance == "said so");
    for (const char* key : {"  unit: mm\n", "  maximum: 2e-4\n", "  p99: 1e-4\n",
                            "  provenance: said so\n", "  command: none\n"})
        CHECK_THROWS_AS(Tolerances::parse(without(key)), defrec::Error);
    for (const char* number : {"much", "-1", "nan", "1,5", "inf"})
        CHECK_THROWS_AS(Tolerances::parse(without("2e-4", number)), defrec::Error);
    CHECK_THROWS_AS(Tolerances::parse(without("2e-4", "5e-5")),
                    defrec::Error);  // less than its p99
    CHECK_THROWS_AS(Tolerances::parse(kGood + kGood), defrec::Error);
    CHECK_THROWS_AS(Tolerances::parse(kGood + "  why: not\n"), defrec::Error);
    CHECK_THROWS_AS(Tolerances::parse("- 1\n"), defrec::Error);
    CHECK_THROWS_AS(Tolerances::parse("a: {"), defrec::Error);
    CHECK_THROWS_AS(Tolerances::parse(kGood).at("warp.colour"), defrec::Error);
}

TEST_CASE("the suite's own tolerances are complete") {
    for (const auto& [name, tolerance] : Tolerances::of_suite().all()) {
        CAPTURE(name);
        CHECK(tolerance.maximum > 0);
        CHECK(tolerance.provenance.size() > 20);
    }
}

TEST_CASE("the maximum and the 99th percentile of distances; what is no number fails") {
    Distances distances("warp.position");
    for (int i = 1; i <= 200; ++i) distances.add(i);
    CHECK(distances.maximum() == 200);
    CHECK(distances.p99() == 198);
    distances.add(std::nan(""));
    CHECK(std::isnan(distances.maximum()));
    CHECK(std::isnan(distances.p99()));
    CHECK(Distances("warp.position").p99() == 0);
}
