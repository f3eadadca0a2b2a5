// The check of a submitted report: is it complete, and does it say what it would say if nobody had
// edited it. docs/backends/conformance.md says what this cannot show.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "conformance/worker/record.hpp"

namespace defrec::conformance {

struct Limits {
    double maximum = 0, p99 = 0;
};

// The suite that the report is held against: this program's own, as far as the report's version had
// it.
struct Suite {
    std::string version;            // a number, as in reports
    std::vector<CaseRecord> cases;  // every case of this version, in the order of their ids; id,
                                    // tier, stage, title and runs count
    std::function<Limits(const CaseRecord&, const Metric&)> limits;
    std::map<std::string, uint32_t> since =
        {};  // by id: the version that brought a case; those not named were there from the first
};

// What is wrong, each one error message; empty if the report is sound. path: report.json, or its
// folder, in which case the other two files are checked as well. library: the plugin that the
// report is to be of.
std::vector<std::string> verify_report(const std::filesystem::path& path, const Suite& suite,
                                       const std::optional<std::filesystem::path>& library = {});

}  // namespace defrec::conformance
