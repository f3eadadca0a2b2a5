// The program `defrec-bench`: for machines that have a driver and a C library and nothing else.
#include <CLI/CLI.hpp>
#include <memory>

#include "sdk/cli/bench/bench.hpp"
#include "sdk/cli/commands/command_line.hpp"
#include "sdk/cli/commands/commands.hpp"
#include "sdk/cli/commands/help_text.hpp"

namespace defrec::cli {

int run_bench_program(int argc, const char* const* argv) {
    CLI::App app("defrec-bench: how fast this machine's devices follow a rendered scene");
    app.name("defrec-bench");
    app.formatter(std::make_shared<HelpText>(help_width()));
    app.allow_windows_style_options(false);  // "/x" is a path everywhere
    app.set_version_flag("--version", std::string("defrec-bench ") + defrec_version_string());
    app.require_subcommand(1);
    std::function<int()> run;
    add_devices_command(app, run);
    add_bench_command(app, run, {});
    return carry_out(app, run, argc, argv);
}

}  // namespace defrec::cli
