// `defrec register` on the command line.
#include <CLI/CLI.hpp>
#include <map>
#include <memory>

#include "sdk/cli/commands/commands.hpp"
#include "sdk/contract/descs.hpp"
#include "sdk/io/number_checks.hpp"
#include "sdk/registration/program/run_register.hpp"

namespace defrec::cli {
namespace {

constexpr const char* kFooter =
    "Examples:\n"
    "  defrec register --pairs pairs.csv --targets plan.csv --out registered\n"
    "  defrec register --model liver.stl --unit mm --surface tracked/template.ply --pairs "
    "pairs.csv "
    "--out registered\n"
    "  defrec register --model liver.obj --part liver --template organ.template --start start.csv "
    "--targets "
    "plan.csv --plan liver.plan --out registered\n"
    "\n"
    "Exit codes: 0 registered, 2 usage, 3 input unreadable, 7 output failed, 9 not registered: "
    "ambiguous,\n"
    "undetermined or failed, 130 interrupted.";

void add_inputs(CLI::App& command, RegisterOptions& options) {
    command.add_option("--model", options.model, "The organ's surface: STL, OBJ or PLY")
        ->type_name("F");
    command
        .add_option_function<std::string>(
            "--unit",
            [&options](const std::string& name) {
                options.unit = name == "m"    ? MeshUnit::kMetre
                               : name == "cm" ? MeshUnit::kCentimetre
                                              : MeshUnit::kMillimetre;
            },
            "Unit of the model: mm, cm or m; default: mm, or m where its size says so")
        ->type_name("UNIT")
        ->check(CLI::IsMember({"mm", "cm", "m"}));
    command
        .add_option("--part", options.part,
                    "The part of the model whose surface is seen, where the file has several")
        ->type_name("NAME");
    command
        .add_option("--surface", options.surface,
                    "What the camera saw: PLY or CSV with x, y, z in mm, and where known nx, ny, "
                    "nz, xx, xy, xz, yy, yz, zz, expected_error_mm and status")
        ->type_name("F");
    command
        .add_option("--template", options.seen_template,
                    "What the camera saw: the template of `defrec track --save-template`, in place "
                    "of --surface")
        ->type_name("F");
    command
        .add_option("--pairs", options.pairs,
                    "CSV id,model_x,model_y,model_z,x,y,z[,error_mm,model_error_mm]: places of the "
                    "model, and where they were seen")
        ->type_name("F");
    command
        .add_option("--start", options.start,
                    "About where the model lies: CSV x,y,z,t with the three rows of [R | t], or an "
                    "earlier registration.json")
        ->type_name("F");
    command
        .add_option("--targets", options.targets,
                    "CSV id,x,y,z of places in the model whose error is wanted")
        ->type_name("F");
    command
        .add_option("--plan", options.plan,
                    "Write model, parts, targets and registration as a plan of the template, which "
                    "`defrec track --plan` follows")
        ->type_name("F");
    command.add_flag(
        "--pairs-only", options.is_by_pairs_alone,
        "Register by the pairs alone: the surface is not looked at, and the model goes into the "
        "plan; for models that are not what is seen");
    command.add_flag(
        "--looked-at", options.is_looked_at,
        "Write the plan of a registration that is ambiguous or undetermined as well: a "
        "person has looked at it");
    command.add_option("--out", options.out, "Folder for registration.json and registration.png")
        ->type_name("DIR")
        ->required();
}

template <class Number>
void add_number(CLI::App& command, const char* name, std::optional<Number>& value, const char* what,
                double most, double least = 0) {
    command.add_option(name, value, what)->type_name("N")->check(number_in(least, most));
}

void add_search(CLI::App& command, RegisterOptions& options) {
    add_number(command, "--max-turn", options.start_turn_degrees,
               "How far the start may be turned, degrees; default 30", 180);
    add_number(command, "--max-shift", options.start_shift_mm,
               "How far it may be shifted, mm; default 30", 500);
    add_number(command, "--starts", options.starts,
               "From how many poses within that the search begins; default 20", 10000, 1);
    add_number(command, "--point-error", options.point_error_mm,
               "Error of points whose covariance is not given, mm; default 0.5", 100);
    add_number(command, "--model-error", options.model_error_mm,
               "Error of the model's surface, mm; default 0.2", 100);
    add_number(command, "--max-residual", options.max_residual_mm,
               "A registration whose residuals are larger has failed, mm; default 3, of pairs 5",
               100);
    add_number(command, "--max-error", options.max_error_mm,
               "A motion whose expected error is larger is undetermined, mm; default 2", 100);
    command.add_flag("--deform", options.is_deformed,
                     "Deform the model as an elastic body, where the surface says how; writes "
                     "model.ply and targets.csv as well");
    add_number(command, "--deformation", options.deformation_mm,
               "How far its surface may be displaced, root mean square, mm; default 10", 100, 0.1);
    command.add_flag(
        "!--no-camera", options.is_tracked_camera,
        "The surface's frame is not that of the camera: its origin says nothing of what is seen");
    command.add_option("--threads", options.threads, "Threads; 0: one for each core")
        ->type_name("N")
        ->check(CLI::Range(0, int{kContextMaxThreads}));
}

}  // namespace

CLI::App* add_register_command(CLI::App& app, std::function<int()>& run) {
    auto options = std::make_shared<RegisterOptions>();
    CLI::App* command = app.add_subcommand(
        "register", "Find where a preoperative model lies in the camera's frame, and how exactly");
    add_inputs(*command, *options);
    add_search(*command, *options);
    command->add_flag("--json", options->json, "Print registration.json");
    command->add_flag("--quiet", options->quiet, "Print nothing but errors");
    command->footer(kFooter);
    command->callback([options, &run] { run = [options] { return run_register(*options); }; });
    return command;
}

}  // namespace defrec::cli
