// See program.hpp.
#include "conformance/program.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "conformance/options.hpp"

namespace defrec::conformance {
namespace {

int list(const RunOptions& options) {
    for (const Case& one : select_cases(all_cases(), options))
        std::printf("%-44s %s%s%s\n", one.id.c_str(), one.title.c_str(), one.smoke ? " [smoke]" : "", one.slow ? " [slow]" : "");
    return int(ExitCode::passed);
}

void add_run_options(CLI::App& app, RunOptions& options) {
    app.add_option("--plugin", options.plugin, "the plugin to examine: its manifest, or the folder with it");
    app.add_option("--backend", options.backend, "or the name of a plugin beside the library");
    app.add_option("--device", options.device, "id of the device; default: the plugin's first");
    app.add_option("--out", options.out, "folder for the reports");
    app.add_flag("--list", options.list, "only list the cases");
    app.add_option("--tier", options.tiers, "only cases of this tier; may be repeated")
        ->check(CLI::IsMember({"abi", "stage", "sequence", "stress"}));
    app.add_flag("--smoke", options.smoke, "only the short list");
    app.add_option("--case", options.cases, "only the case of this id, or a pattern such as 'stage/orb/*'; may be repeated");
    app.add_option("--seed", options.seed, "of the order of the cases")->capture_default_str();
}

}  // namespace

int run_program(int argc, const char* const* argv) {
    CLI::App app("defrec-conformance: examines a backend plugin, its results against those of the reference");
    app.name("defrec-conformance");
    app.footer("Exit codes: 0 passed, 1 internal error, 2 usage, 5 plugin or device unavailable, 6 failed, 7 output failed.");
    RunOptions options;
    add_run_options(app, options);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? int(ExitCode::passed) : int(ExitCode::usage);
    }
    try {
        if (options.list) return list(options);
    } catch (const Error& error) {
        std::fprintf(stderr, "defrec-conformance: %s.\n", error.what());
        return int(ExitCode::usage);
    }
    std::fprintf(stderr, "defrec-conformance: --list expected.\n");
    return int(ExitCode::usage);
}

}  // namespace defrec::conformance
