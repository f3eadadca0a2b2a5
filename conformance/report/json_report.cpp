#include "conformance/report/json_report.hpp"

#include <cmath>
#include <limits>
#include <span>

#include "conformance/report/report.hpp"
#include "sdk/base/util/sha256.hpp"

namespace defrec::conformance {
namespace {

using nlohmann::json;

std::string digest(const void* data, size_t size) {
    return sha256_hex(std::span(static_cast<const unsigned char*>(data), size));
}
std::string digest(const std::string& text) { return digest(text.data(), text.size()); }

// JSON has no number for these, and they must not be lost: they are why a case failed.
json number(double value) {
    if (std::isnan(value)) return "NaN";
    if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
    return value;
}

json to_json(const Metric& m) {
    return {{"name", m.name},
            {"unit", m.unit},
            {"maximum", number(m.maximum)},
            {"p99", number(m.p99)},
            {"limit_maximum", number(m.limit_maximum)},
            {"limit_p99", number(m.limit_p99)},
            {"samples", m.samples}};
}

json to_json(const Picture& p) {
    return {{"title", p.title},
            {"width", p.width},
            {"height", p.height},
            {"sha256", digest(p.pixels.data(), p.pixels.size())}};
}

json to_json(const CaseRecord& c) {
    json metrics = json::array(), pictures = json::array();
    for (const Metric& m : c.metrics) metrics.push_back(to_json(m));
    for (const Picture& p : c.pictures) pictures.push_back(to_json(p));
    return {{"id", c.id},
            {"tier", c.tier},
            {"stage", c.stage},
            {"title", c.title},
            {"verdict", verdict_name(c.verdict)},
            {"reason", c.reason},
            {"metrics", metrics},
            {"pictures", pictures},
            {"runs", c.runs},
            {"seconds", number(c.seconds)}};
}

json to_json(const Counts& counts) {
    return {{"passed", counts.passed}, {"failed", counts.failed}, {"skipped", counts.skipped}};
}

json counts_of(const RunRecord& run) {
    json tiers = json::object();
    for (const std::string& tier : tiers_of(run)) tiers[tier] = to_json(count_cases(run, tier));
    return {{"all", to_json(count_cases(run))}, {"tiers", tiers}};
}

json to_json(const RunRecord& run) {
    json cases = json::array();
    for (const CaseRecord& c : run.cases) cases.push_back(to_json(c));
    return {{"format", kReportFormat},
            {"suite",
             {{"version", run.suite_version},
              {"revision", run.suite_revision},
              {"dirty", run.suite_dirty}}},
            {"run",
             {{"started", run.started},
              {"command", run.command},
              {"seed", run.seed},
              {"complete", run.complete},
              {"system", run.system},
              {"processor", run.processor}}},
            {"plugin",
             {{"name", run.plugin_name},
              {"version", run.plugin_version},
              {"vendor", run.plugin_vendor},
              {"library", run.plugin_library},
              {"sha256", run.plugin_sha256}}},
            {"device",
             {{"id", run.device_id},
              {"name", run.device_name},
              {"driver", run.device_driver},
              {"kind", run.device_kind},
              {"features", run.device_features},
              {"stages", run.device_stages}}},
            {"counts", counts_of(run)},
            {"cases", cases}};
}

// Reads the members of one object, each once, and at the end knows whether there were others.
class Reader {
  public:
    Reader(const json& object, std::string where) : object_(object), where_(std::move(where)) {
        if (!object.is_object()) throw ReportError(where_ + " is no object");
    }

    const json& member(const char* name) {
        const auto found = object_.find(name);
        if (found == object_.end()) throw ReportError(where_ + " has no member '" + name + "'");
        ++read_;
        return *found;
    }
    Reader object(const char* name) { return {member(name), where_ + "/" + name}; }
    const json& array(const char* name) {
        const json& value = member(name);
        if (!value.is_array()) wrong(name, "an array");
        return value;
    }
    void read(const char* name, std::string& out) {
        const json& value = member(name);
        if (!value.is_string()) wrong(name, "a string");
        out = value.get<std::string>();
    }
    void read(const char* name, bool& out) {
        const json& value = member(name);
        if (!value.is_boolean()) wrong(name, "true or false");
        out = value.get<bool>();
    }
    template <std::unsigned_integral T>
    void read(const char* name, T& out) {
        const json& value = member(name);
        if (!value.is_number_unsigned() || value.get<uint64_t>() > std::numeric_limits<T>::max())
            wrong(name, "a whole number in range");
        out = value.get<T>();
    }
    void read(const char* name, double& out) {
        const json& value = member(name);
        if (value.is_number())
            out = value.get<double>();
        else if (value == "NaN")
            out = std::numeric_limits<double>::quiet_NaN();
        else if (value == "Infinity" || value == "-Infinity")
            out = value == "Infinity" ? std::numeric_limits<double>::infinity()
                                      : -std::numeric_limits<double>::infinity();
        else
            wrong(name, "a number");
    }
    void finish() const {
        if (read_ != object_.size())
            throw ReportError(where_ + " has members that the schema does not name");
    }
    [[noreturn]] void wrong(const char* name, const char* expected) const {
        throw ReportError(where_ + "/" + name + " is not " + expected);
    }

  private:
    const json& object_;
    std::string where_;
    size_t read_ = 0;
};

Metric metric_of(const json& value, const std::string& where) {
    Metric m;
    Reader in(value, where);
    in.read("name", m.name);
    in.read("unit", m.unit);
    in.read("maximum", m.maximum);
    in.read("p99", m.p99);
    in.read("limit_maximum", m.limit_maximum);
    in.read("limit_p99", m.limit_p99);
    in.read("samples", m.samples);
    in.finish();
    return m;
}

Picture picture_of(const json& value, const std::string& where) {
    Picture p;
    std::string pixels;
    Reader in(value, where);
    in.read("title", p.title);
    in.read("width", p.width);
    in.read("height", p.height);
    in.read("sha256", pixels);
    in.finish();
    return p;
}

CaseRecord case_of(const json& value, const std::string& where) {
    CaseRecord c;
    Reader in(value, where);
    in.read("id", c.id);
    in.read("tier", c.tier);
    in.read("stage", c.stage);
    in.read("title", c.title);
    std::string verdict;
    in.read("verdict", verdict);
    c.verdict = verdict == "passed"   ? Verdict::passed
                : verdict == "failed" ? Verdict::failed
                                      : Verdict::skipped;
    if (verdict != verdict_name(c.verdict)) in.wrong("verdict", "passed, failed or skipped");
    in.read("reason", c.reason);
    for (const json& m : in.array("metrics")) c.metrics.push_back(metric_of(m, where + "/metrics"));
    for (const json& p : in.array("pictures"))
        c.pictures.push_back(picture_of(p, where + "/pictures"));
    in.read("runs", c.runs);
    in.read("seconds", c.seconds);
    in.finish();
    return c;
}

}  // namespace

std::string content_digest(json report) {
    report.erase("digests");
    return digest(report.dump());
}

std::string report_text(const RunRecord& run, const std::string& junit, const std::string& page) {
    json report = to_json(run);
    report["digests"] = {{"content", content_digest(report)},
                         {kJunitFile, digest(junit)},
                         {kPageFile, digest(page)}};
    return file_text(report);
}

std::string file_text(const json& report) {
    std::string text = "{";
    for (const auto& [name, value] : report.items()) {
        text += (text.size() > 1 ? ",\n " : "\n ") + json(name).dump() + ": ";
        if (!value.is_array()) {
            text += value.dump();
            continue;
        }
        text += "[";
        for (const json& element : value)
            text += (text.back() == '[' ? "\n  " : ",\n  ") + element.dump();
        text += "\n ]";
    }
    return text + "\n}\n";
}

RunRecord record_of(const json& report) {
    RunRecord run;
    Reader in(report, "the report");
    unsigned format = 0;
    in.read("format", format);
    if (format != kReportFormat)
        throw ReportError("the report has format " + std::to_string(format) +
                          ", this program reads " + std::to_string(kReportFormat));
    Reader suite = in.object("suite");
    suite.read("version", run.suite_version);
    suite.read("revision", run.suite_revision);
    suite.read("dirty", run.suite_dirty);
    suite.finish();
    Reader about = in.object("run");
    about.read("started", run.started);
    about.read("command", run.command);
    about.read("seed", run.seed);
    about.read("complete", run.complete);
    about.read("system", run.system);
    about.read("processor", run.processor);
    about.finish();
    Reader plugin = in.object("plugin");
    plugin.read("name", run.plugin_name);
    plugin.read("version", run.plugin_version);
    plugin.read("vendor", run.plugin_vendor);
    plugin.read("library", run.plugin_library);
    plugin.read("sha256", run.plugin_sha256);
    plugin.finish();
    Reader device = in.object("device");
    device.read("id", run.device_id);
    device.read("name", run.device_name);
    device.read("driver", run.device_driver);
    device.read("kind", run.device_kind);
    device.read("features", run.device_features);
    device.read("stages", run.device_stages);
    device.finish();
    for (const json& c : in.array("cases"))
        run.cases.push_back(case_of(c, "case " + std::to_string(run.cases.size())));
    if (in.member("counts") != counts_of(run))
        throw ReportError("the counts do not follow from the cases");
    Reader digests = in.object("digests");
    std::string text;
    for (const char* name : {"content", kJunitFile, kPageFile}) digests.read(name, text);
    digests.finish();
    in.finish();
    return run;
}

}  // namespace defrec::conformance
