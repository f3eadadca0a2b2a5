// What submitted reports are held against.
#include "conformance/runner/suite.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "conformance/runner/runner.hpp"
#include "conformance/worker/tolerances.hpp"

using namespace defrec::conformance;

TEST_CASE("every case once, in the order of the ids, with all that a report has of it") {
    const Suite suite = this_suite();
    CHECK(suite.cases.size() == all_cases().size() + 1);
    const auto not_before = [](const CaseRecord& a, const CaseRecord& b) { return a.id >= b.id; };
    CHECK(std::adjacent_find(suite.cases.begin(), suite.cases.end(), not_before) ==
          suite.cases.end());
    for (const CaseRecord& one : suite.cases) {
        CAPTURE(one.id);
        CHECK(one.id.starts_with(one.tier + "/"));
        CHECK(
            (one.stage.empty() || (one.id + "/").find("/" + one.stage + "/") != std::string::npos));
        CHECK(one.title.ends_with("."));
        CHECK(one.runs == (one.id == end_of_process_case().id ? 1 : kRepetitions));
    }
}

TEST_CASE("a metric's limits are its tolerance, or nothing at all") {
    const Suite suite = this_suite();
    const CaseRecord& any = suite.cases.front();
    for (const auto& [name, tolerance] : Tolerances::of_suite().all()) {
        Metric metric;
        metric.name = name;
        CHECK(suite.limits(any, metric).maximum == tolerance.maximum);
        CHECK(suite.limits(any, metric).p99 == tolerance.p99);
    }
    Metric exact;
    exact.name = "disparity";
    CHECK(suite.limits(any, exact).maximum == 0);
    CHECK(suite.limits(any, exact).p99 == 0);
}
