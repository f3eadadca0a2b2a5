#include "conformance/report/verify.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>
#include <span>

#include "backends/stages/list.hpp"
#include "conformance/report/json_report.hpp"
#include "conformance/report/report.hpp"
#include "sdk/base/util/sha256.hpp"

namespace defrec::conformance {
namespace {

using nlohmann::json;

std::string read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file) throw ReportError("cannot read " + path.string());
    return text;
}

std::string digest_of_file(const std::filesystem::path& path) {
    const std::string bytes = read_file(path);
    return sha256_hex(
        std::span(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

json parse(const std::string& text, const std::filesystem::path& path) {
    try {
        return json::parse(text);
    } catch (const json::exception& error) {
        throw ReportError(path.string() + " is no JSON: " + error.what());
    }
}

std::string figures(double maximum, double p99) {
    return json(maximum).dump() + " and " + json(p99).dump();
}

class Check {
  public:
    Check(const RunRecord& run, const Suite& suite) : run_(run), suite_(suite) {}

    std::vector<std::string> violations() {
        version_ = version_of(run_.suite_version);
        if (version_ == 0 || version_ > version_of(suite_.version)) {
            say("the report is of suite version " + run_.suite_version +
                ", this program checks versions up to " + suite_.version);
            return std::move(found_);
        }
        provenance();
        case_list();
        for (const CaseRecord& c : run_.cases) one_case(c);
        if (const uint64_t failed = count_cases(run_).failed; failed > 0)
            say(std::to_string(failed) + " cases failed");
        return std::move(found_);
    }

  private:
    // 0 for what is no version.
    static uint32_t version_of(const std::string& text) {
        uint32_t version = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), version);
        return error == std::errc() && end == text.data() + text.size() ? version : 0;
    }
    bool had(const CaseRecord& expected) const {
        const auto brought = suite_.since.find(expected.id);
        return brought == suite_.since.end() || brought->second <= version_;
    }

    void say(std::string message) { found_.push_back(std::move(message)); }

    void provenance() {
        const bool named =
            run_.suite_revision.size() == 40 &&
            run_.suite_revision.find_first_not_of("0123456789abcdef") == std::string::npos;
        if (!named)
            say("the revision of the suite is '" + run_.suite_revision +
                "', so nobody can tell what was run");
        if (run_.suite_dirty)
            say("the suite was built from a tree with changes that its revision does not name");
        if (!run_.complete) say("the run was not complete: it left out tiers or cases");
    }

    void case_list() {
        const auto by_id = [](const CaseRecord& a, const CaseRecord& b) { return a.id < b.id; };
        if (!std::is_sorted(run_.cases.begin(), run_.cases.end(), by_id))
            say("the cases are not in the order of their ids");
        for (const CaseRecord& expected : suite_.cases) {
            if (!had(expected)) continue;
            const auto same_id = [&](const CaseRecord& c) { return c.id == expected.id; };
            const auto count = std::count_if(run_.cases.begin(), run_.cases.end(), same_id);
            if (count != 1)
                say("case " + expected.id +
                    (count == 0 ? " is missing" : " is there " + std::to_string(count) + " times"));
        }
    }

    void one_case(const CaseRecord& c) {
        const auto expected =
            std::find_if(suite_.cases.begin(), suite_.cases.end(),
                         [&](const CaseRecord& e) { return e.id == c.id && had(e); });
        if (expected == suite_.cases.end()) {
            say("case " + c.id + " is none of the suite's");
            return;
        }
        if (c.tier != expected->tier || c.stage != expected->stage || c.title != expected->title)
            say("case " + c.id + " has another tier, stage or title than the suite gives it");
        if (c.verdict == Verdict::skipped)
            skipped(c);
        else if (c.verdict == Verdict::passed && c.runs != expected->runs)
            say("case " + c.id + " was run " + std::to_string(c.runs) + " times, " +
                std::to_string(expected->runs) + " are expected");
        if ((c.verdict == Verdict::passed) != c.reason.empty())
            say("case " + c.id + " has a reason and is passed, or has none and is not");
        // What these two compare they measure, so that nothing measured is something taken out.
        if (c.verdict == Verdict::passed && (c.tier == "stage" || c.tier == "sequence") &&
            c.metrics.empty())
            say("case " + c.id + " is passed without a figure");
        for (const Metric& m : c.metrics) metric(c, m);
    }

    void metric(const CaseRecord& c, const Metric& m) {
        if (c.verdict != Verdict::failed && !m.passed())
            say("case " + c.id + " is " + verdict_name(c.verdict) + ", but " + m.name +
                " is beyond its limit");
        const Limits limits = suite_.limits(c, m);
        if (m.limit_maximum != limits.maximum || m.limit_p99 != limits.p99)
            say("case " + c.id + " holds " + m.name + " against " +
                figures(m.limit_maximum, m.limit_p99) + ", the suite's limits are " +
                figures(limits.maximum, limits.p99));
    }

    // A device without a stage skips that stage's cases; one without every stage, what needs them
    // all.
    void skipped(const CaseRecord& c) {
        bool lacking = false;
        for (uint32_t i = 0; i < DEFREC_STAGE_COUNT_V1; ++i)
            lacking |= (run_.device_stages >> i & 1) == 0 &&
                       (c.stage.empty() || c.stage == kStageNames[i]);
        if (!lacking)
            say("case " + c.id +
                " was skipped, though the device claims every stage that it needs");
    }

    const RunRecord& run_;
    const Suite& suite_;
    uint32_t version_ = 0;  // of the report
    std::vector<std::string> found_;
};

}  // namespace

std::vector<std::string> verify_report(const std::filesystem::path& path, const Suite& suite,
                                       const std::optional<std::filesystem::path>& library) {
    try {
        const bool folder = std::filesystem::is_directory(path);
        const std::filesystem::path file = folder ? path / kReportFile : path;
        const std::string text = read_file(file);
        const json report = parse(text, file);
        const RunRecord run = record_of(report);
        std::vector<std::string> found = Check(run, suite).violations();
        const json& digests = report["digests"];
        if (content_digest(report) != digests["content"])
            found.push_back("the content is not what its digest was taken of");
        // Members given twice, which readers take differently, or anything else that the writer
        // does not write.
        if (file_text(report) != text)
            found.push_back("the file is not in the form in which the suite writes it");
        if (folder)
            for (const char* name : {kJunitFile, kPageFile}) {
                if (!std::filesystem::exists(path / name))
                    found.push_back(std::string(name) + " is missing");
                else if (digest_of_file(path / name) != digests[name])
                    found.push_back(std::string(name) + " is not what its digest was taken of");
            }
        if (library && digest_of_file(*library) != run.plugin_sha256)
            found.push_back("the report is of a plugin with SHA-256 " + run.plugin_sha256 +
                            ", which " + library->filename().string() + " has not");
        return found;
    } catch (const ReportError& error) {
        return {error.what()};
    } catch (const std::filesystem::filesystem_error& error) {
        return {error.what()};
    }
}

}  // namespace defrec::conformance
