// See examine.hpp.
#include "conformance/runner/examine.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "conformance/report/revision.hpp"
#include "conformance/worker/system.hpp"
#include "conformance/worker/text_file.hpp"
#include "sdk/base/os/platform.hpp"

namespace defrec::conformance {
namespace {

std::string utc_now() {
    using namespace std::chrono;
    const auto now = floor<seconds>(system_clock::now());
    const auto day = floor<days>(now);
    const year_month_day date(day);
    const hh_mm_ss time(now - day);
    char text[64];
    std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02dZ", int(date.year()),
                  unsigned(date.month()), unsigned(date.day()), int(time.hours().count()),
                  int(time.minutes().count()), int(time.seconds().count()));
    return text;
}

std::string file_name(const std::string& path) { return path.substr(platform::name_start(path)); }

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

RunSettings settings_of(const RunOptions& options) {
    RunSettings settings;
    settings.seed = options.seed;
    if (options.smoke) settings.repetitions = kSmokeRepetitions;
    settings.in_process = options.in_process;
    settings.time_limit = std::chrono::seconds(options.time_limit_s);
    return settings;
}

RunRecord examine(const RunOptions& options) {
    const std::vector<Case> cases = select_cases(all_cases(), options);
    const Examination who = find_plugins(options);
    RunRecord record;
    record.started = utc_now();
    RunSettings settings = settings_of(options);
    const bool terminal = isatty(STDERR_FILENO) == 1;
    if (terminal) settings.progress = show_progress;
    RunOutcome outcome = run_cases(who, cases, settings);
    if (terminal) std::fprintf(stderr, "\r\033[K");
    if (!outcome.refusal.empty())
        throw Unavailable(concat(who.subject.name, ": ", outcome.refusal));

    record.suite_version = std::string(kSuiteVersion);
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
