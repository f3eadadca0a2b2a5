// `defrec doctor` on the command line.
#include <CLI/CLI.hpp>
#include <memory>

#include "sdk/cli/commands/commands.hpp"
#include "sdk/cli/commands/source_options.hpp"
#include "sdk/doctor/doctor.hpp"

namespace defrec::cli {
namespace {

constexpr const char* kFooter =
    "Example:\n"
    "  defrec doctor --left left.mp4 --right right.mp4 --calibration stereo.yaml\n"
    "\n"
    "Exit codes: 0 nothing is wrong, 2 usage, 3 input unreadable, 4 calibration unreadable, 5 no "
    "device,\n"
    "9 something is wrong, 130 interrupted.";

}  // namespace

CLI::App* add_doctor_command(CLI::App& app, std::function<int()>& run) {
    auto options = std::make_shared<DoctorOptions>();
    CLI::App* command = app.add_subcommand(
        "doctor", "Say what is wrong with a recording and its calibration, and what to do");
    add_source_options(*command, options->source);
    add_calibration_options(*command, options->calibration, options->units);
    add_device_options(*command, options->probe.backend, options->probe.device,
                       options->probe.threads);
    command
        ->add_option("--config", options->probe.config,
                     "YAML with parameters of the tracker by name, as of `defrec track`")
        ->type_name("F");
    command->add_flag("--quiet", options->quiet, "Print nothing but errors");
    command->add_flag("--json", options->json, "Print what was found as JSON");
    command->footer(kFooter);
    command->callback([options, &run] { run = [options] { return run_doctor(*options); }; });
    return command;
}

}  // namespace defrec::cli
