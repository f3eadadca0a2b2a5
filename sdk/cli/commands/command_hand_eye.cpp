// `defrec handeye` on the command line.
#include <CLI/CLI.hpp>
#include <memory>

#include "sdk/cli/commands/commands.hpp"
#include "sdk/hand_eye/program/run_hand_eye.hpp"
#include "sdk/io/number_checks.hpp"

namespace defrec::cli {
namespace {

constexpr const char* kFooter =
    "Examples:\n"
    "  defrec handeye --camera-poses board.csv --tracker-poses marker.csv --pairs --out "
    "hand_eye.json\n"
    "  defrec handeye --camera-poses camera.txt --tracker-poses marker.csv --out hand_eye.json\n"
    "\n"
    "Exit codes: 0 solved, 2 usage, 3 input unreadable, 7 output failed, 9 refused: the motion "
    "does not\n"
    "determine the transform, or none fits.";

void add_unit(CLI::App& command, const char* name, std::optional<PoseUnit>& unit) {
    command
        .add_option_function<std::string>(
            name,
            [&unit](const std::string& given) {
                unit = given == "m"    ? PoseUnit::kMetre
                       : given == "cm" ? PoseUnit::kCentimetre
                                       : PoseUnit::kMillimetre;
            },
            "Unit of its lengths: mm, cm or m; default: mm of CSV, m of TUM")
        ->type_name("UNIT")
        ->check(CLI::IsMember({"mm", "cm", "m"}));
}

void add_number(CLI::App& command, const char* name, std::optional<double>& value, const char* what,
                double least, double most) {
    command.add_option(name, value, what)->type_name("N")->check(number_in(least, most));
}

void add_inputs(CLI::App& command, HandEyeCommand& options) {
    command
        .add_option("--camera-poses", options.camera_poses,
                    "The camera in its world: CSV time_s,x,y,z,qx,qy,qz,qw or TUM trajectory")
        ->type_name("F")
        ->required();
    command
        .add_option("--tracker-poses", options.tracker_poses,
                    "The camera's marker in the tracking system, likewise")
        ->type_name("F")
        ->required();
    add_unit(command, "--camera-unit", options.camera_unit);
    add_unit(command, "--tracker-unit", options.tracker_unit);
    command.add_flag("--invert-camera", options.is_camera_inverted,
                     "The camera's file has the world in the camera, as solvePnP gives it");
    command.add_flag("--invert-tracker", options.is_tracker_inverted,
                     "The tracker's file has the tracking system in the marker");
    command.add_option("--out", options.out, "File for the result, as JSON")->type_name("F");
}

void add_limits(CLI::App& command, HandEyeCommand& options) {
    constexpr double kLeast = 1e-4, kDay = 86400, kMost = 100, kSearched = 60;
    command.add_flag("--pairs", options.is_paired,
                     "Line i of both files belong together; their times count nothing");
    add_number(command, "--offset", options.offset_s,
               "Tracker's time less camera's time, s; without it, it is estimated", -kDay, kDay);
    add_number(command, "--max-offset", options.max_offset_s,
               "It is looked for up to it, s; default 2", kLeast, kSearched);
    add_number(command, "--camera-error", options.camera_error_mm,
               "Standard deviation of the camera's places along each axis, mm", kLeast, kMost);
    add_number(command, "--camera-error-deg", options.camera_error_degrees,
               "That of its rotations about each axis, degrees", kLeast, kMost);
    add_number(command, "--tracker-error", options.tracker_error_mm,
               "That of the marker's places, mm", kLeast, kMost);
    add_number(command, "--tracker-error-deg", options.tracker_error_degrees,
               "That of its rotations, degrees", kLeast, kMost);
    add_number(command, "--max-residual", options.max_residual_mm,
               "Larger residuals: refused, mm; default 3", kLeast, kMost);
    add_number(command, "--max-residual-deg", options.max_residual_degrees,
               "Likewise, degrees; default 2", kLeast, kMost);
    add_number(command, "--max-error", options.max_error_mm,
               "A motion whose expected error is larger is undetermined, mm; default 1", kLeast,
               kMost);
}

}  // namespace

CLI::App* add_hand_eye_command(CLI::App& app, std::function<int()>& run) {
    auto options = std::make_shared<HandEyeCommand>();
    CLI::App* command = app.add_subcommand(
        "handeye", "Find where the camera is on the marker that a tracking system sees");
    add_inputs(*command, *options);
    add_limits(*command, *options);
    command->add_flag("--json", options->json, "Print the result as JSON");
    command->add_flag("--quiet", options->quiet, "Print nothing but errors");
    command->footer(kFooter);
    command->callback([options, &run] { run = [options] { return run_hand_eye(*options); }; });
    return command;
}

}  // namespace defrec::cli
