// See suite.hpp.
#include "conformance/runner/suite.hpp"

#include <algorithm>

#include "conformance/runner/examine.hpp"

namespace defrec::conformance {
namespace {

CaseRecord expected_record(const Case& one, uint32_t runs) {
    CaseRecord record;
    record.id = one.id;
    record.tier = one.tier;
    record.stage = one.stage;
    record.title = one.title;
    record.runs = runs;
    return record;
}

}  // namespace

Suite this_suite() {
    Suite suite{kSuiteVersion, {}, [](const CaseRecord&, const Metric& metric) {
                    const auto& tolerances = Tolerances::of_suite().all();
                    const auto found = tolerances.find(metric.name);
                    return found == tolerances.end()
                               ? Limits{}
                               : Limits{found->second.maximum, found->second.p99};
                }};
    for (const Case& one : all_cases()) {
        suite.cases.push_back(expected_record(one, kRepetitions));
        if (one.since > 1) suite.since[one.id] = one.since;
    }
    suite.cases.push_back(expected_record(end_of_process_case(), 1));
    std::sort(suite.cases.begin(), suite.cases.end(),
              [](const CaseRecord& a, const CaseRecord& b) { return a.id < b.id; });
    return suite;
}

}  // namespace defrec::conformance
