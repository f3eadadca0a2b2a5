#include "conformance/report/report.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "conformance/report/json_report.hpp"
#include "conformance/report/junit.hpp"
#include "conformance/report/page.hpp"
#include "conformance/report/text.hpp"
#include "sdk/base/os/atomic_file.hpp"

namespace defrec::conformance {
namespace {

double share(double value, double limit) {
    if (std::isnan(value)) return std::numeric_limits<double>::infinity();
    if (value <= 0 && limit >= 0) return 0;
    return limit > 0 ? value / limit : std::numeric_limits<double>::infinity();
}

void write_file(const std::filesystem::path& path, const std::string& text) {
    try {
        write_atomically(path, text);
    } catch (const FileError& error) {
        throw ReportError(error.what());
    }
}

}  // namespace

Counts count_cases(const RunRecord& run, const std::string& tier) {
    Counts counts;
    for (const CaseRecord& c : run.cases)
        if (tier.empty() || c.tier == tier) counts.add(c.verdict);
    return counts;
}

std::vector<std::string> tiers_of(const RunRecord& run) {
    std::vector<std::string> tiers{"abi", "stage", "sequence", "stress"};
    for (const CaseRecord& c : run.cases)
        if (std::find(tiers.begin(), tiers.end(), c.tier) == tiers.end()) tiers.push_back(c.tier);
    std::erase_if(tiers,
                  [&](const std::string& tier) { return count_cases(run, tier).total() == 0; });
    return tiers;
}

const char* verdict_name(Verdict verdict) {
    switch (verdict) {
        case Verdict::passed:
            return "passed";
        case Verdict::failed:
            return "failed";
        case Verdict::skipped:
            break;
    }
    return "skipped";
}

double share_of_limit(const Metric& metric) {
    return std::max(share(metric.maximum, metric.limit_maximum),
                    share(metric.p99, metric.limit_p99));
}

void write_report(const RunRecord& given, const std::filesystem::path& folder) {
    const RunRecord run = with_valid_text(given);
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw ReportError("cannot create " + folder.string() + ": " + error.message());
    std::filesystem::remove(folder / kReportFile, error);
    const std::string junit = junit_xml(run), page = page_html(run);
    write_file(folder / kJunitFile, junit);
    write_file(folder / kPageFile, page);
    write_file(folder / kReportFile, report_text(run, junit, page));
}

}  // namespace defrec::conformance
