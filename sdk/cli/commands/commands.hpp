// The subcommands that live in this folder. Each adds itself to the app; when the user chose it,
// `run` is set to the function that carries it out and returns the exit code, or throws CliError.
// `run` must outlive the parsing.
#pragma once

#include <functional>
#include <string>

#include "sdk/io/calibration.hpp"

namespace CLI {
class App;
}

namespace defrec::cli {

CLI::App* add_track_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_doctor_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_record_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_register_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_calibrate_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_hand_eye_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_score_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_evaluate_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_demo_command(CLI::App& app, std::function<int()>& run);
// Completes all commands that the app has when it is run.
CLI::App* add_completion_command(CLI::App& app, std::function<int()>& run);
CLI::App* add_devices_command(CLI::App& app, std::function<int()>& run);

struct BenchSequence;
// Reads the user's own frames for bench; empty where the program cannot read images.
using BenchLoader = std::function<BenchSequence(const std::string& left, const std::string& right,
                                                const std::string& calibration, LengthUnit units)>;
CLI::App* add_bench_command(CLI::App& app, std::function<int()>& run, BenchLoader load);

// All commands of `defrec`, and what it says of itself.
void add_commands(CLI::App& app, std::function<int()>& run);

// The whole program `defrec` but for the signal handlers: parses, runs, prints failures; returns
// the exit code.
int run_program(int argc, const char* const* argv);
// `defrec-bench`: of its subcommands bench and devices, which need no image files and so none of
// the libraries that read them.
int run_bench_program(int argc, const char* const* argv);

}  // namespace defrec::cli
