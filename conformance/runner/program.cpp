// See program.hpp.
#include "conformance/runner/program.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>

#include "conformance/report/report.hpp"
#include "conformance/runner/examine.hpp"
#include "conformance/runner/suite.hpp"
#include "sdk/base/os/platform.hpp"

namespace defrec::conformance {
namespace {

int list(const RunOptions& options) {
    for (const Case& one : select_cases(all_cases(), options))
        std::printf("%-44s %s%s%s\n", one.id.c_str(), one.title.c_str(),
                    one.smoke ? " [smoke]" : "", one.slow ? " [slow]" : "");
    return int(ExitCode::passed);
}

void summarise(const RunRecord& run) {
    size_t passed = 0, failed = 0, skipped = 0;
    double seconds = 0;
    for (const CaseRecord& one : run.cases) {
        ++(one.verdict == Verdict::passed   ? passed
           : one.verdict == Verdict::failed ? failed
                                            : skipped);
        seconds += one.seconds;
        if (one.verdict == Verdict::failed)
            std::printf("FAILED  %s: %s\n", one.id.c_str(), one.reason.c_str());
        if (one.verdict == Verdict::skipped)
            std::printf("skipped %s: %s\n", one.id.c_str(), one.reason.c_str());
    }
    std::printf("%s %s on %s: %zu passed, %zu failed, %zu skipped, %.1f s%s\n",
                run.plugin_name.c_str(), run.plugin_version.c_str(), run.device_id.c_str(), passed,
                failed, skipped, seconds, run.complete ? "" : "; not the whole suite");
}

int run(const RunOptions& options) {
    const RunRecord record = examine(options);
    platform::without_file_size_signal([&] { write_report(record, options.out); });
    summarise(record);
    const bool failed =
        std::any_of(record.cases.begin(), record.cases.end(),
                    [](const CaseRecord& one) { return one.verdict == Verdict::failed; });
    return int(failed ? ExitCode::failed : ExitCode::passed);
}

struct VerifyOptions {
    std::string report, library;
};

int verify(const VerifyOptions& options) {
    const std::optional<std::filesystem::path> library =
        options.library.empty() ? std::nullopt
                                : std::optional<std::filesystem::path>(options.library);
    const std::vector<std::string> violations =
        verify_report(options.report, this_suite(), library);
    for (const std::string& violation : violations) std::printf("%s.\n", violation.c_str());
    if (violations.empty())
        std::printf("%s: complete and as the suite wrote it; every case passed.\n",
                    options.report.c_str());
    return int(violations.empty() ? ExitCode::passed : ExitCode::failed);
}

CLI::App* add_verify_command(CLI::App& app, VerifyOptions& options) {
    CLI::App* command = app.add_subcommand(
        "verify", "checks that a report is complete, unedited, and of a plugin that passed");
    command->add_option("report", options.report, "the folder that --out named, or a report.json")
        ->required();
    command->add_option("--library", options.library,
                        "the plugin's library, to compare with the report's SHA-256");
    return command;
}

// Empty if the options can be run.
std::string missing_option(const RunOptions& options) {
    if (options.plugin.empty() == options.backend.empty())
        return "one of --plugin and --backend expected";
    if (options.out.empty()) return "--out expected: the folder for the reports";
    return "";
}

void add_run_options(CLI::App& app, RunOptions& options) {
    app.add_option("--plugin", options.plugin,
                   "the plugin to examine: its manifest, or the folder with it");
    app.add_option("--backend", options.backend, "or the name of a plugin beside the library");
    app.add_option("--device", options.device, "id of the device; default: the plugin's first");
    app.add_option("--out", options.out, "folder for the reports");
    app.add_flag("--list", options.list, "only list the cases");
    app.add_option("--tier", options.tiers, "only cases of this tier; may be repeated")
        ->check(CLI::IsMember({"abi", "stage", "sequence", "stress"}));
    app.add_flag("--smoke", options.smoke, "only the short list");
    app.add_option("--case", options.cases,
                   "only the case of this id, or a pattern such as 'stage/orb/*'; may be repeated");
    app.add_option("--time-limit", options.time_limit_s,
                   "s for one repetition of a case, ten times as much for slow ones")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    app.add_flag("--in-process", options.in_process,
                 "for tools that look at one process: no child processes, no time limits");
    app.add_option("--seed", options.seed, "of the order of the cases")->capture_default_str();
}

}  // namespace

int run_program(int argc, const char* const* argv) {
    CLI::App app(
        "defrec-conformance: examines a backend plugin, its results against those of the "
        "reference");
    app.name("defrec-conformance");
    app.allow_windows_style_options(false);  // "/x" is a path everywhere
    app.footer(
        "Exit codes: 0 passed, 1 internal error, 2 usage, 5 plugin or device unavailable, 6 "
        "failed, 7 output failed.");
    RunOptions options;
    add_run_options(app, options);
    VerifyOptions verify_options;
    const CLI::App* const verify_command = add_verify_command(app, verify_options);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? int(ExitCode::passed) : int(ExitCode::usage);
    }
    try {
        if (verify_command->parsed()) return verify(verify_options);
        if (options.list) return list(options);
        const std::string missing = missing_option(options);
        if (!missing.empty()) fail(DEFREC_ERROR_ARGUMENT, missing);
        return run(options);
    } catch (const Unavailable& error) {
        std::fprintf(stderr, "defrec-conformance: %s.\n", error.what());
        return int(ExitCode::unavailable);
    } catch (const ReportError& error) {
        std::fprintf(stderr, "defrec-conformance: %s.\n", error.what());
        return int(ExitCode::output);
    } catch (const Error& error) {
        std::fprintf(stderr, "defrec-conformance: %s.\n", error.what());
        return int(error.status() == DEFREC_ERROR_ARGUMENT ? ExitCode::usage : ExitCode::internal);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "defrec-conformance: internal error: %s.\n", error.what());
        return int(ExitCode::internal);
    }
}

}  // namespace defrec::conformance
