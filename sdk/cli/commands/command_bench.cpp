// `defrec bench` on the command line.
#include <CLI/CLI.hpp>
#include <memory>

#include "sdk/cli/bench/bench.hpp"
#include "sdk/cli/bench/compare.hpp"
#include "sdk/cli/commands/command_options.hpp"
#include "sdk/cli/commands/commands.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr const char* kFooter =
    "Times are of the library alone: the frames lie in memory, one is in flight at a time. The "
    "sequence is\n"
    "run twice: as an application runs it, and for the stages' times with a wait after each.\n"
    "\n"
    "Examples:\n"
    "  defrec bench --threads 2\n"
    "  defrec bench --threads 2 --json > before.json\n"
    "  defrec bench --threads 2 --compare before.json --limit 5\n"
    "  defrec bench --size 360x288 --backend reference --frames 20\n"
    "  defrec bench --scene slide --filmed 45 --warm-up 180 --config grow.yaml\n"
    "\n"
    "Exit codes: 0 done, 1 a fault, 2 usage, 3 input unreadable, 4 calibration invalid, 5 no "
    "device, 6 "
    "slower than the\n"
    "run of --compare, 130 interrupted.";

struct Given {
    BenchOptions bench;
    std::string left, right, calibration;
    std::string recorded;  // JSON of an earlier run to compare with, or empty
    double limit_percent = 10;
    LengthUnit units = LengthUnit::kGuarded;
};

void parse_size(const std::string& text, BenchOptions& options) {
    const std::vector<std::string_view> parts = split(text, 'x');
    const auto width = parse_integer(parts[0]),
               height = parts.size() == 2 ? parse_integer(parts[1]) : std::nullopt;
    if (!width || !height || *width < 160 || *height < 120 || *width > 3840 || *height > 2160)
        throw CliError(ExitCode::kUsage,
                       "--size: '" + text + "' is not WxH from 160x120 to 3840x2160.");
    options.width = static_cast<int>(*width);
    options.height = static_cast<int>(*height);
}

int run_bench(const Given& given, const BenchLoader& load) {
    if (!given.left.empty() && given.calibration.empty())
        throw CliError(ExitCode::kUsage, "--left and --right need --calibration.");
    const nlohmann::ordered_json recorded =
        given.recorded.empty() ? nlohmann::ordered_json() : read_recorded_run(given.recorded);
    const BenchSequence sequence =
        given.left.empty() ? filmed_sequence(given.bench)
                           : load(given.left, given.right, given.calibration, given.units);
    if (!given.recorded.empty()) check_comparable(recorded, sequence_json(sequence));
    const BenchTimes times = measure_times(given.bench, sequence);
    if (times.latency_ms.empty()) return static_cast<int>(ExitCode::kInterrupted);
    auto json = bench_json(given.bench, sequence, times);
    std::string text = bench_text(json);
    bool is_slower = false;
    if (!given.recorded.empty()) {
        const double limit = given.limit_percent / 100;
        const std::vector<ComparedTime> compared = compare_runs(recorded, json, limit);
        is_slower = any_beyond(compared);
        text += '\n' + comparison_text(compared, limit);
        json["compared"] = comparison_json(compared);
    }
    print(given.bench.json ? json_text(json, 2) + "\n" : text);
    if (interrupt_requested()) return static_cast<int>(ExitCode::kInterrupted);
    return static_cast<int>(is_slower ? ExitCode::kBelowThreshold : ExitCode::kOk);
}

void add_scene_options(CLI::App& command, Given& given) {
    command
        .add_option_function<std::string>(
            "--size", [&given](const std::string& text) { parse_size(text, given.bench); },
            "Size of the rendered scene; default 960x540")
        ->type_name("WxH");
    command.add_option("--scene", given.bench.scene, "Rendered scene, of defrec render --list")
        ->type_name("NAME")
        ->capture_default_str();
    command
        .add_option("--filmed", given.bench.filmed,
                    "Frames of the scene, played to and fro, so that nothing jumps")
        ->type_name("N")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
}

void add_file_options(CLI::App& command, Given& given) {
    auto* left =
        command.add_option("--left", given.left,
                           "Left images to measure on, held in memory; default: a rendered scene");
    auto* right = command.add_option("--right", given.right, "Right images, likewise");
    left->type_name("P")->needs(right);
    for (const char* of_scene : {"--size", "--scene", "--filmed"}) left->excludes(of_scene);
    right->type_name("P")->needs(left);
    command.add_option("--calibration", given.calibration, "Of these images")
        ->type_name("F")
        ->needs(left);
    add_units_option(command, given.units);
}

void add_measurement_options(CLI::App& command, BenchOptions& options) {
    command.add_option("--frames", options.frames, "Frames to measure")
        ->type_name("N")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    command
        .add_option("--warm-up", options.warm_up, "Frames tracked before, which are not measured")
        ->type_name("N")
        ->check(CLI::Range(0, 10000))
        ->capture_default_str();
    command.add_flag("!--no-stages", options.stages,
                     "Only the times from submission to result, in one run");
    add_deadline_option(command, options.deadline_ns);
    command
        .add_option("--trackers", options.trackers,
                    "Measure so many trackers at once, too, each on a thread of its own")
        ->type_name("N")
        ->check(CLI::Range(1, 256))
        ->capture_default_str();
    command.add_flag("--spread", options.spread,
                     "Spread those trackers over all devices of the backend");
    command
        .add_option("--beneath", options.beneath,
                    "Measure the body beneath the surface, too: until it is ready, and so many "
                    "targets in each frame")
        ->type_name("N")
        ->check(CLI::Range(0, 1000000))
        ->capture_default_str();
}

void add_comparison_options(CLI::App& command, Given& given) {
    auto* compare = command.add_option(
        "--compare", given.recorded,
        "JSON that an earlier run printed: show its times beside these, exit with 6 where a stage "
        "or the frame is slower by more than the limit and the noise");
    compare->type_name("F");
    command.add_option("--limit", given.limit_percent, "Of --compare, percent")
        ->type_name("P")
        ->check(number_in(0.0, 1000.0))
        ->needs(compare)
        ->capture_default_str();
}

}  // namespace

CLI::App* add_bench_command(CLI::App& app, std::function<int()>& run, BenchLoader load) {
    auto options = std::make_shared<Given>();
    CLI::App* command = app.add_subcommand("bench", "Measure how long each stage takes");
    add_scene_options(*command, *options);
    if (load) add_file_options(*command, *options);
    add_device_options(*command, options->bench.backend, options->bench.device,
                       options->bench.threads);
    command
        ->add_option("--config", options->bench.config,
                     "YAML with parameters of the tracker by name")
        ->type_name("F");
    add_measurement_options(*command, options->bench);
    add_comparison_options(*command, *options);
    command->add_flag("--json", options->bench.json, "Print JSON");
    command->add_flag("--quiet", options->bench.quiet, "No progress bar");
    command->footer(kFooter);
    command->callback([options, load = std::move(load), &run] {
        run = [options, load] { return run_bench(*options, load); };
    });
    return command;
}

}  // namespace defrec::cli
