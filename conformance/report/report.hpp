// What a run leaves behind: report.json, junit.xml and index.html, in one folder.
#pragma once
#include <filesystem>
#include <stdexcept>

#include "conformance/worker/record.hpp"

namespace defrec::conformance {

inline constexpr const char* kReportFile = "report.json";
inline constexpr const char* kJunitFile = "junit.xml";
inline constexpr const char* kPageFile = "index.html";

// A report could not be written, or is none; what() is an error message.
class ReportError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

struct Counts {
    uint64_t passed = 0, failed = 0, skipped = 0;

    uint64_t total() const { return passed + failed + skipped; }
    void add(Verdict verdict) {
        ++(verdict == Verdict::passed ? passed : verdict == Verdict::failed ? failed : skipped);
    }
};
// tier: empty counts all.
Counts count_cases(const RunRecord& run, const std::string& tier = {});
// The tiers that occur, in the order abi, stage, sequence, stress, others.
std::vector<std::string> tiers_of(const RunRecord& run);
const char* verdict_name(Verdict verdict);
// Share of the limit that the metric uses, of maximum and p99 the larger: at most 1 is passed.
// Infinite where the limit is 0 or the value NaN.
double share_of_limit(const Metric& metric);

// Creates the folder where absent and replaces what an earlier run left there; report.json comes
// last. Throws ReportError.
void write_report(const RunRecord& run, const std::filesystem::path& folder);

}  // namespace defrec::conformance
