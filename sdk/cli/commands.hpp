// The subcommands that live in this folder. Each adds itself to the app; when the user chose it, `run` is set
// to the function that carries it out and returns the exit code, or throws CliError. `run` must outlive the
// parsing.
#pragma once

#include <functional>
#include <string>

namespace CLI {
class App;
}

namespace defrec::cli {

CLI::App* add_track_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_score_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_devices_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_bench_command(CLI::App& app, std::function<int()>& run);

// The whole program but for the signal handlers: parses, runs, prints failures; returns the exit code.
int run_program(int argc, const char* const* argv);

}  // namespace defrec::cli
