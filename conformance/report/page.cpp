#include "conformance/report/page.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "backends/stages/list.hpp"
#include "conformance/report/page_css.hpp"
#include "conformance/report/page_js.hpp"
#include "conformance/report/png.hpp"
#include "conformance/report/report.hpp"
#include "sdk/base/util/markup.hpp"

namespace defrec::conformance {
namespace {

std::string base64(const std::vector<uint8_t>& bytes) {
    static constexpr char kDigits[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    out.reserve((bytes.size() + 2) / 3 * 4);
    for (size_t i = 0; i < bytes.size(); i += 3) {
        const size_t left = bytes.size() - i;
        const uint32_t word = uint32_t{bytes[i]} << 16 |
                              (left > 1 ? uint32_t{bytes[i + 1]} << 8 : 0u) |
                              (left > 2 ? bytes[i + 2] : 0u);
        out += kDigits[word >> 18];
        out += kDigits[word >> 12 & 63];
        out += left > 1 ? kDigits[word >> 6 & 63] : '=';
        out += left > 2 ? kDigits[word & 63] : '=';
    }
    return out;
}

std::string shown(double value) {
    char text[32];
    std::snprintf(text, sizeof text,
                  std::abs(value) < 1e7 && value == std::floor(value) ? "%.0f" : "%.4g", value);
    return text;
}

std::string element(const std::string& name, const std::string& text,
                    const std::string& type = {}) {
    return "<" + name + (type.empty() ? "" : " class=\"" + type + "\"") + ">" + escaped(text) +
           "</" + name + ">";
}

std::string chip(Verdict verdict) {
    return element("span", verdict_name(verdict), std::string("chip ") + verdict_name(verdict));
}

std::string stage_of(const CaseRecord& c) { return c.stage.empty() ? "none" : c.stage; }

// ---- the head ---------------------------------------------------------------

std::string outcome(const RunRecord& run) {
    const Counts counts = count_cases(run);
    const bool failed = counts.failed > 0 || counts.passed == 0,
               whole = run.complete && !run.suite_dirty;
    const char* tone = failed ? "failed" : whole ? "passed" : "partial";
    std::string verdict = failed ? "Failed" : whole ? "Passed" : "Passed, but no certificate";
    std::string text = std::to_string(counts.total()) + " cases: " + std::to_string(counts.passed) +
                       " passed, " + std::to_string(counts.failed) + " failed, " +
                       std::to_string(counts.skipped) + " skipped.";
    if (!run.complete) text += " Only part of the suite was run.";
    if (run.suite_dirty)
        text += " The suite was built from a tree with changes that its revision does not name.";
    return "<section class=\"outcome " + std::string(tone) + "\" aria-label=\"Outcome\">" +
           element("p", verdict, "verdict") + element("p", text) + "</section>\n";
}

std::string device_kind(uint32_t kind) {
    switch (kind) {
        case DEFREC_DEVICE_CPU:
            return "CPU";
        case DEFREC_DEVICE_CUDA:
            return "CUDA";
        case DEFREC_DEVICE_VULKAN:
            return "Vulkan";
        default:
            return "kind " + std::to_string(kind);
    }
}

std::string device_stages(uint32_t stages) {
    std::string text;
    for (uint32_t i = 0; i < DEFREC_STAGE_COUNT_V1; ++i)
        if ((stages >> i & 1) != 0)
            text += (text.empty() ? "" : ", ") + std::string(kStageNames[i]);
    return text.empty() ? "none" : text;
}

std::string facts(const RunRecord& run) {
    double seconds = 0;
    for (const CaseRecord& c : run.cases) seconds += c.seconds;
    const auto fact = [](const char* name, const std::string& text) {
        return element("dt", name) + element("dd", text) + "\n";
    };
    return "<section aria-labelledby=\"facts\"><h2 id=\"facts\">Who, by what, where</h2><dl "
           "class=\"facts\">\n" +
           fact("Device",
                run.device_name + " (" + run.device_id + ", " + device_kind(run.device_kind) +
                    ((run.device_features & DEFREC_FEATURE_SOFTWARE) != 0 ? ", in software)"
                                                                          : ")")) +
           fact("Driver", run.device_driver) + fact("Stages", device_stages(run.device_stages)) +
           fact("Claims", (run.device_features & DEFREC_FEATURE_REPEATABLE) != 0
                              ? "repeatable: the same input gives the same bits"
                              : "nothing beyond the definition") +
           fact("Plugin", run.plugin_name + " " + run.plugin_version + ", " + run.plugin_vendor) +
           fact("Library", run.plugin_library + ", SHA-256 " + run.plugin_sha256) +
           fact("Suite", "version " + run.suite_version + ", revision " + run.suite_revision +
                             (run.suite_dirty ? ", with changes" : "")) +
           fact("Command", run.command) +
           fact("Started", run.started + ", took " + shown(std::round(seconds)) +
                               " s, seed of the order " + std::to_string(run.seed)) +
           fact("System", run.system) + fact("Processor", run.processor) + "</dl></section>\n";
}

std::vector<std::string> stages_of(const RunRecord& run) {
    std::vector<std::string> stages{"none"};
    stages.insert(stages.end(), std::begin(kStageNames), std::end(kStageNames));
    std::set<std::string> present;
    for (const CaseRecord& c : run.cases) present.insert(stage_of(c));
    std::erase_if(stages, [&](const std::string& stage) { return !present.contains(stage); });
    for (const std::string& stage : present)
        if (std::find(stages.begin(), stages.end(), stage) == stages.end()) stages.push_back(stage);
    return stages;
}

std::string overview(const RunRecord& run) {
    const std::vector<std::string> tiers = tiers_of(run);
    std::string html =
        "<section aria-labelledby=\"overview\"><h2 id=\"overview\">By stage and tier</h2>"
        "<table class=\"overview\"><thead><tr><th>stage</th>";
    for (const std::string& tier : tiers) html += element("th", tier);
    html += "</tr></thead><tbody>\n";
    for (const std::string& stage : stages_of(run)) {
        html += "<tr>" + element("th", stage);
        for (const std::string& tier : tiers) {
            Counts counts;
            for (const CaseRecord& c : run.cases)
                if (c.tier == tier && stage_of(c) == stage) counts.add(c.verdict);
            html += "<td>";
            if (counts.total() == 0) html += "<span class=\"none\">-</span>";
            if (counts.failed > 0)
                html += element("b", std::to_string(counts.failed) + " failed") +
                        (counts.total() > counts.failed ? ", " : "");
            if (counts.passed > 0)
                html +=
                    std::to_string(counts.passed) + " passed" + (counts.skipped > 0 ? ", " : "");
            if (counts.skipped > 0)
                html += element("span", std::to_string(counts.skipped) + " skipped", "none");
            html += "</td>";
        }
        html += "</tr>\n";
    }
    return html + "</tbody></table></section>\n";
}

// ---- cases ------------------------------------------------------------------

std::string against_limit(double value, double limit) {
    return element("td", shown(value) + " of " + shown(limit),
                   value <= limit ? "value" : "value beyond");
}

std::string bar(const Metric& m) {
    const double share = share_of_limit(m);
    const char* tone = !m.passed() ? "failed" : share > 0.8 ? "partial" : "passed";
    const std::string text =
        std::isinf(share) ? "beyond the limit" : shown(std::round(100 * share)) + " % of the limit";
    return "<td><span class=\"bar " + std::string(tone) + "\" title=\"" + text +
           "\"><i style=\"width:" + shown(std::round(100 * std::min(share, 1.0))) +
           "%\"></i></span></td>";
}

std::string metrics_table(const CaseRecord& c) {
    if (c.metrics.empty()) return {};
    std::string html =
        "<table class=\"metrics\"><thead><tr><th>measured</th><th class=\"value\">maximum</th><th "
        "class=\"value\">p99</th>"
        "<th class=\"value\">samples</th><th>share of the limit</th></tr></thead><tbody>\n";
    for (const Metric& m : c.metrics)
        html += "<tr>" + element("td", m.name + (m.unit.empty() ? "" : " [" + m.unit + "]")) +
                against_limit(m.maximum, m.limit_maximum) + against_limit(m.p99, m.limit_p99) +
                element("td", std::to_string(m.samples), "value") + bar(m) + "</tr>\n";
    return html + "</tbody></table>";
}

std::string heading(const CaseRecord& c) {
    std::string html = element("h3", c.id) + element("p", c.title, "about");
    if (!c.reason.empty())
        html += "<p class=\"cause " + std::string(verdict_name(c.verdict)) + "\">" +
                escaped(c.reason) + "</p>";
    return html;
}

std::string pictures(const CaseRecord& c) {
    if (c.pictures.empty()) return {};
    std::string html = "<div class=\"pictures\">\n";
    for (const Picture& p : c.pictures)
        html += "<figure><img width=\"" + std::to_string(p.width) + "\" height=\"" +
                std::to_string(p.height) + "\" alt=\"" + escaped(p.title) +
                "\" src=\"data:image/png;base64," + base64(png_of(p)) + "\">" +
                element("figcaption", p.title) + "</figure>\n";
    return html + "</div>";
}

std::string failures(const RunRecord& run) {
    std::string html;
    for (const CaseRecord& c : run.cases)
        if (c.verdict == Verdict::failed)
            html += "<div class=\"failure\">" + heading(c) + metrics_table(c) + pictures(c) +
                    "</div>\n";
    if (html.empty()) return {};
    return "<section aria-labelledby=\"failures\"><h2 id=\"failures\">What failed</h2>\n" + html +
           "</section>\n";
}

std::string choice(const char* name, const char* all, const std::vector<std::string>& values) {
    std::string html = "<select name=\"" + std::string(name) + "\" aria-label=\"" + name +
                       "\"><option value=\"\">" + all + "</option>";
    for (const std::string& value : values) html += element("option", value);
    return html + "</select>\n";
}

std::string case_list(const RunRecord& run) {
    std::string html =
        "<section aria-labelledby=\"cases\"><h2 id=\"cases\">Every case</h2>\n<form "
        "class=\"filters\" hidden>\n"
        "<input name=\"words\" type=\"search\" placeholder=\"words in name, title, reason\" "
        "aria-label=\"words\">\n" +
        choice("verdict", "every verdict", {"passed", "failed", "skipped"}) +
        choice("tier", "every tier", tiers_of(run)) +
        choice("stage", "every stage", stages_of(run)) +
        "<output name=\"count\"></output>\n</form>\n<table class=\"cases\"><tbody>\n";
    for (const CaseRecord& c : run.cases)
        html += "<tr class=\"case\" data-verdict=\"" + std::string(verdict_name(c.verdict)) +
                "\" data-tier=\"" + escaped(c.tier) + "\" data-stage=\"" + escaped(stage_of(c)) +
                "\"><td>" + chip(c.verdict) + "</td><td>" + heading(c) + metrics_table(c) +
                element("p",
                        std::to_string(c.runs) + (c.runs == 1 ? " run, " : " runs, ") +
                            shown(std::round(1000 * c.seconds)) + " ms",
                        "about") +
                "</td></tr>\n";
    return html + "</tbody></table></section>\n";
}

}  // namespace

std::string page_html(const RunRecord& run) {
    return "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta "
           "name=\"color-scheme\" "
           "content=\"light dark\">\n"
           "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src "
           "'unsafe-inline'; style-src "
           "'unsafe-inline'; "
           "img-src data:\">\n" +
           element("title", "defrec: conformance of " + run.device_name) + "\n<style>\n" +
           kPageStyle + "</style>\n</head>\n<body>\n<header>" +
           element("p", "Conformance report", "kind") + element("h1", run.device_name) +
           "</header>\n<main>\n" + outcome(run) + facts(run) + overview(run) + failures(run) +
           case_list(run) +
           "</main>\n<footer><p>Each case was run several times; figures are the worst of the "
           "repetitions, and a case passes "
           "only if both the maximum "
           "and the 99th percentile stay within their limits. The same content for programs: "
           "report.json and "
           "junit.xml.</p></footer>\n"
           "<script>\n" +
           kPageScript + "</script>\n</body>\n</html>\n";
}

}  // namespace defrec::conformance
