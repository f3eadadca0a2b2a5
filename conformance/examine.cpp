// See examine.hpp.
#include "conformance/examine.hpp"

#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>

#include "conformance/report/revision.hpp"

namespace defrec::conformance {
namespace {

std::string utc_now() {
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    gmtime_r(&now, &parts);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
    return text;
}

// What stands behind the key in the first line of a file that begins with it; empty if none does.
std::string value_in(const char* path, const std::string& key) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        if (!line.starts_with(key)) continue;
        const size_t start = line.find_first_not_of(" \t:=\"", key.size());
        const size_t end = line.find_last_not_of(" \t\"");
        return start == std::string::npos ? "" : line.substr(start, end + 1 - start);
    }
    return "";
}

std::string system_text() {
    utsname names{};
    uname(&names);
    const std::string distribution = value_in("/etc/os-release", "PRETTY_NAME");
    return concat(names.sysname, " ", names.release, " ", names.machine,
                  distribution.empty() ? "" : ", ", distribution);
}

std::string file_name(const std::string& path) { return path.substr(path.find_last_of('/') + 1); }

// Who repeats the run needs these; folders say nothing to others.
std::string command_text(const RunOptions& options) {
    std::string text = options.backend.empty() ? concat("--plugin ", file_name(options.plugin))
                                               : concat("--backend ", options.backend);
    if (!options.device.empty()) text.append(" --device ").append(options.device);
    for (const std::string& tier : options.tiers) text.append(" --tier ").append(tier);
    if (options.smoke) text.append(" --smoke");
    if (options.in_process) text.append(" --in-process");
    for (const std::string& one : options.cases) text.append(" --case ").append(one);
    return concat(text, " --time-limit ", options.time_limit_s, " --seed ", options.seed);
}

Examination find_plugins(const RunOptions& options) {
    try {
        return {
            options.backend.empty() ? find_plugin(options.plugin) : find_backend(options.backend),
            find_backend("reference"), options.device};
    } catch (const Error& error) {
        throw Unavailable(error.what());
    }
}

// A line that is drawn over, on a terminal only.
void show_progress(size_t done, size_t total, const std::string& id) {
    std::fprintf(stderr, "\r\033[K[%zu/%zu] %s", done, total, id.c_str());
    std::fflush(stderr);
}

}  // namespace

RunRecord examine(const RunOptions& options) {
    const std::vector<Case> cases = select_cases(all_cases(), options);
    const Examination who = find_plugins(options);
    RunRecord record;
    record.started = utc_now();
    RunSettings settings;
    settings.seed = options.seed;
    settings.in_process = options.in_process;
    settings.time_limit = std::chrono::seconds(options.time_limit_s);
    const bool terminal = isatty(STDERR_FILENO) == 1;
    if (terminal) settings.progress = show_progress;
    RunOutcome outcome = run_cases(who, cases, settings);
    if (terminal) std::fprintf(stderr, "\r\033[K");
    if (!outcome.refusal.empty())
        throw Unavailable(concat(who.subject.name, ": ", outcome.refusal));

    record.suite_version = kSuiteVersion;
    record.suite_revision = suite_revision().id;
    record.suite_dirty = suite_revision().dirty;
    record.command = command_text(options);
    record.seed = options.seed;
    record.complete =
        options.tiers.empty() && options.cases.empty() && !options.smoke && !options.in_process;
    record.plugin_name = who.subject.name;
    record.plugin_version = who.subject.version;
    record.plugin_vendor = outcome.device.plugin_vendor;
    record.plugin_library = file_name(who.subject.library);
    record.plugin_sha256 = who.subject.sha256;
    record.device_id = outcome.device.id;
    record.device_name = outcome.device.name;
    record.device_driver = outcome.device.driver;
    record.device_kind = outcome.device.kind;
    record.device_features = outcome.device.features;
    record.device_stages = outcome.device.stages;
    record.system = system_text();
    record.processor = value_in("/proc/cpuinfo", "model name");
    record.cases = std::move(outcome.cases);
    std::sort(record.cases.begin(), record.cases.end(),
              [](const CaseRecord& a, const CaseRecord& b) { return a.id < b.id; });
    return record;
}

}  // namespace defrec::conformance
