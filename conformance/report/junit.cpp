#include "conformance/report/junit.hpp"

#include <cstdio>

#include "conformance/report/report.hpp"
#include "sdk/base/util/markup.hpp"

namespace defrec::conformance {
namespace {

std::string number(const char* format, double value) {
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

std::string attribute(const char* name, const std::string& value) {
    // Line ends in an attribute would be read as spaces.
    std::string text;
    for (const char c : escaped(value)) {
        if (c == '\n' || c == '\r' || c == '\t')
            text += "&#" + std::to_string(static_cast<int>(c)) + ";";
        else
            text += c;
    }
    return std::string(" ") + name + "=\"" + text + "\"";
}

std::string totals(const Counts& counts) {
    return attribute("tests", std::to_string(counts.total())) +
           attribute("failures", std::to_string(counts.failed)) + attribute("errors", "0") +
           attribute("skipped", std::to_string(counts.skipped));
}

std::string metric_lines(const CaseRecord& c) {
    std::string text;
    for (const Metric& m : c.metrics)
        text += m.name + " [" + m.unit + "]: maximum " + number("%.9g", m.maximum) + " (limit " +
                number("%.9g", m.limit_maximum) + "), p99 " + number("%.9g", m.p99) + " (limit " +
                number("%.9g", m.limit_p99) + "), " + std::to_string(m.samples) + " samples\n";
    return escaped(text);
}

std::string test_case(const CaseRecord& c) {
    std::string text = "    <testcase" +
                       attribute("classname", c.stage.empty() ? c.tier : c.tier + "." + c.stage) +
                       attribute("name", c.id) + attribute("time", number("%.3f", c.seconds)) +
                       ">\n";
    if (c.verdict == Verdict::failed)
        text += "      <failure" + attribute("message", c.reason) + ">" + metric_lines(c) +
                "</failure>\n";
    else if (c.verdict == Verdict::skipped)
        text += "      <skipped" + attribute("message", c.reason) + "/>\n";
    else if (!c.metrics.empty())
        text += "      <system-out>" + metric_lines(c) + "</system-out>\n";
    return text + "    </testcase>\n";
}

}  // namespace

std::string junit_xml(const RunRecord& run) {
    double seconds = 0;
    for (const CaseRecord& c : run.cases) seconds += c.seconds;
    std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites" +
                      attribute("name", "defrec-conformance " + run.device_id) +
                      totals(count_cases(run)) + attribute("time", number("%.3f", seconds)) + ">\n";
    for (const std::string& tier : tiers_of(run)) {
        std::string cases;
        double tier_seconds = 0;
        for (const CaseRecord& c : run.cases) {
            if (c.tier != tier) continue;
            cases += test_case(c);
            tier_seconds += c.seconds;
        }
        xml += "  <testsuite" + attribute("name", tier) + totals(count_cases(run, tier)) +
               attribute("time", number("%.3f", tier_seconds)) +
               attribute("timestamp", run.started) + ">\n" + cases + "  </testsuite>\n";
    }
    return xml + "</testsuites>\n";
}

}  // namespace defrec::conformance
