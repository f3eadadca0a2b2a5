// `defrec bench`: how long each stage takes, on a rendered sequence held in memory or on the user's own
// frames.
#include <stdlib.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "sdk/cli/command_options.hpp"
#include "sdk/cli/commands.hpp"
#include "sdk/cli/interrupt.hpp"
#include "sdk/cli/library.hpp"
#include "sdk/cli/process_memory.hpp"
#include "sdk/cli/render/render_command.hpp"
#include "sdk/cli/result_record.hpp"
#include "sdk/cli/statistics.hpp"
#include "sdk/cli/terminal.hpp"
#include "sdk/cli/text.hpp"
#include "sdk/cli/track_summary.hpp"
#include "sdk/cli/tracker_config.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr char kScene[] = "heartbeat";
constexpr int kRenderedFrames = 16;   // played to and fro, so that no cut is in the sequence
constexpr int kFramesInMemory = 200;  // most of the user's own

struct BenchOptions {
    int width = 960, height = 540;
    int frames = 100, warm_up = 10;
    std::string left, right, calibration, config;
    LengthUnit units = LengthUnit::kGuarded;
    std::string backend = "auto", device;
    unsigned threads = 0;
    bool json = false, quiet = false;
};

struct Sequence {
    StereoCalibration calibration;
    std::vector<StereoFrame> frames;
};

// Removes what was rendered once it is in memory.
class TemporaryFolder {
  public:
    TemporaryFolder() {
        std::string name = (fs::temp_directory_path() / "defrec-bench-XXXXXX").string();
        if (::mkdtemp(name.data()) == nullptr) {
            throw CliError(ExitCode::kOutput, name + ": no temporary folder can be created; set TMPDIR.");
        }
        path_ = name;
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

void parse_size(const std::string& text, BenchOptions& options) {
    const std::vector<std::string_view> parts = split(text, 'x');
    const auto width = parse_integer(parts[0]),
               height = parts.size() == 2 ? parse_integer(parts[1]) : std::nullopt;
    if (!width || !height || *width < 160 || *height < 120 || *width > 3840 || *height > 2160) {
        throw CliError(ExitCode::kUsage, "--size: '" + text + "' is not WxH from 160x120 to 3840x2160.");
    }
    options.width = static_cast<int>(*width);
    options.height = static_cast<int>(*height);
}

Sequence load_sequence(const std::string& left, const std::string& right, const std::string& calibration,
                       LengthUnit units) {
    SourceOptions source_options;
    source_options.left = left;
    source_options.right = right;
    source_options.range.last = kFramesInMemory;
    FrameSource source(source_options);
    Sequence sequence;
    sequence.calibration = load_calibration(calibration, units);
    fit_to_frames(sequence.calibration, source.width(), source.height());
    StereoFrame frame;
    while (source.next(frame)) sequence.frames.push_back(frame);
    return sequence;
}

Sequence rendered_sequence(const BenchOptions& options) {
    const TemporaryFolder folder;
    RenderOptions render;
    render.scene = kScene;
    render.out_dir = folder.path().string();
    render.width = options.width;
    render.height = options.height;
    render.frames = kRenderedFrames;
    render.threads = static_cast<int>(options.threads);
    {
        ProgressBar progress(options.quiet);
        try {
            render_sequence(render, [&](int done, int total) { progress.update(done, total, "rendering"); });
        } catch (const RenderUsageError& error) {
            throw CliError(ExitCode::kUsage, error.what());
        } catch (const RenderOutputError& error) {
            throw CliError(ExitCode::kOutput, error.what());
        }
    }
    return load_sequence(folder.path() / "left", folder.path() / "right", folder.path() / "calibration.yaml",
                         LengthUnit::kGuarded);
}

// 0 1 2 1 0 1 2 ... for three frames.
std::size_t to_and_fro(std::size_t step, std::size_t count) {
    if (count == 1) return 0;
    const std::size_t place = step % (2 * (count - 1));
    return place < count ? place : 2 * (count - 1) - place;
}

struct Measured {
    std::vector<FrameRow> rows;
    std::vector<double> latency_ms;  // from submission to result
    double memory_mb = 0;            // what context and tracker added to the process at their peak
    Device device;
};

// timed: the host waits after each stage.
Measured measure(const BenchOptions& options, const Sequence& sequence, bool timed) {
    using Clock = std::chrono::steady_clock;
    Measured measured;
    reset_peak_memory();
    const double before = resident_megabytes();
    const Context context = open_context({options.threads, options.quiet, {}});
    measured.device = choose_device(context, options.backend, options.device);
    const Rig rig = make_rig(context, sequence.calibration);
    auto desc = initialised<defrec_tracker_desc>();
    desc.device_id = measured.device.id.c_str();
    desc.format = format_of_channels(sequence.frames.front().left.channels);
    desc.frames_in_flight = 1;
    if (!options.config.empty()) read_config(options.config, desc);
    desc.timed = timed ? 1 : 0;
    defrec_tracker handle = nullptr;
    require(defrec_tracker_create(context.get(), rig.get(), &desc, &handle),
            options.config.empty() ? ExitCode::kInternal : ExitCode::kUsage, "creating the tracker");
    const Tracker tracker(handle);

    ProgressBar progress(options.quiet);
    constexpr double kFrameMs = 1000.0 / 30;
    const int total = options.warm_up + options.frames;
    for (int step = 0; step < total && !interrupt_requested(); ++step) {
        StereoFrame frame =
            sequence.frames[to_and_fro(static_cast<std::size_t>(step), sequence.frames.size())];
        frame.index = step;
        frame.timestamp_ms = step * kFrameMs;
        const Clock::time_point start = Clock::now();
        const Job job = submit(tracker, frame);
        require(defrec_job_wait(job.get(), UINT64_MAX), ExitCode::kInternal, "frame " + std::to_string(step));
        const double latency = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
        progress.update(step + 1, total, step < options.warm_up ? "warming up" : "measuring");
        if (step < options.warm_up) continue;
        auto result = initialised<defrec_result>();
        require(defrec_job_result(job.get(), &result), ExitCode::kInternal, "reading the result");
        measured.rows.push_back(frame_row(frame, result));
        measured.latency_ms.push_back(latency);
    }
    measured.memory_mb = peak_megabytes() - before;
    return measured;
}

Json bench_json(const BenchOptions& options, const Sequence& sequence, const Measured& measured, const Measured& stages) {
    const double median = percentile(measured.latency_ms, 0.5);
    Json json;
    json["defrec"] = defrec_version_string();
    json["device"] = {{"id", measured.device.id}, {"name", measured.device.name}};
    json["threads"] = options.threads;
    json["size"] =
        std::to_string(sequence.calibration.width) + "x" + std::to_string(sequence.calibration.height);
    json["sequence"] = options.left.empty() ? std::string(kScene) : options.left;
    json["frames"] = measured.rows.size();
    json["tracked_frames"] =
        std::count_if(measured.rows.begin(), measured.rows.end(), [](const FrameRow& row) {
            return row.state == "tracking" || row.state == "degraded" || row.state == "relocalised";
        });
    json["stages"] = stage_statistics(stages.rows);
    json["submit_to_result"] = {{"median_ms", median}, {"p99_ms", percentile(measured.latency_ms, 0.99)}};
    json["frames_per_second"] = median > 0 ? 1000 / median : 0;
    json["peak_memory_mb"] = peak_megabytes();
    json["tracker_memory_mb"] = measured.memory_mb;
    return json;
}

std::string bench_text(const Json& json) {
    const auto line = [](std::string name, const Json& times) {
        name.resize(std::max<std::size_t>(name.size(), 20), ' ');
        std::string median = format_fixed(times["median_ms"].get<double>(), 2);
        std::string p99 = format_fixed(times["p99_ms"].get<double>(), 2);
        median.insert(0, median.size() < 10 ? 10 - median.size() : 0, ' ');
        p99.insert(0, p99.size() < 10 ? 10 - p99.size() : 0, ' ');
        return name + median + p99 + "\n";
    };
    std::string text = json["device"]["id"].get<std::string>() + ", " + json["size"].get<std::string>() +
                       ", " + std::to_string(json["frames"].get<std::size_t>()) + " frames, " +
                       std::to_string(json["tracked_frames"].get<std::size_t>()) + " of them tracked\n";
    text += "ms                      median       p99\n";
    for (const auto& [stage, times] : json["stages"].items()) {
        if (stage != "frame") text += line(stage, times);
    }
    text += line("all stages", json["stages"]["frame"]);
    text += line("submit to result", json["submit_to_result"]);
    return text + format_fixed(json["frames_per_second"].get<double>(), 1) + " frames/s; peak memory " +
           format_fixed(json["peak_memory_mb"].get<double>(), 0) + " MB, of it tracker " +
           format_fixed(json["tracker_memory_mb"].get<double>(), 0) + " MB\n";
}

int run_bench(const BenchOptions& options) {
    if (!options.left.empty() && options.calibration.empty()) {
        throw CliError(ExitCode::kUsage, "--left and --right need --calibration.");
    }
    const Sequence sequence =
        options.left.empty() ? rendered_sequence(options)
                             : load_sequence(options.left, options.right, options.calibration, options.units);
    const Measured measured = measure(options, sequence, false);
    const Measured stages = measure(options, sequence, true);
    if (stages.rows.empty()) return static_cast<int>(ExitCode::kInterrupted);
    const Json json = bench_json(options, sequence, measured, stages);
    print(options.json ? json.dump(2) + "\n" : bench_text(json));
    return static_cast<int>(interrupt_requested() ? ExitCode::kInterrupted : ExitCode::kOk);
}

}  // namespace

CLI::App* add_bench_command(CLI::App& app, std::function<int()>& run) {
    auto options = std::make_shared<BenchOptions>();
    CLI::App* command = app.add_subcommand("bench", "Measure how long each stage takes");
    auto* left = command->add_option("--left", options->left,
                                     "Left images to measure on, held in memory; default: a rendered scene");
    auto* right = command->add_option("--right", options->right, "Right images, likewise");
    left->type_name("P")->needs(right);
    right->type_name("P")->needs(left);
    command->add_option("--calibration", options->calibration, "Of these images")
        ->type_name("F")
        ->needs(left);
    add_units_option(*command, options->units);
    command
        ->add_option_function<std::string>(
            "--size", [options](const std::string& text) { parse_size(text, *options); },
            "Size of the rendered scene; default 960x540")
        ->type_name("WxH")
        ->excludes(left);
    add_device_options(*command, options->backend, options->device, options->threads);
    command->add_option("--config", options->config, "YAML with parameters of the tracker by name")
        ->type_name("F");
    command->add_option("--frames", options->frames, "Frames to measure")
        ->type_name("N")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    command->add_option("--warm-up", options->warm_up, "Frames tracked before, which are not measured")
        ->type_name("N")
        ->check(CLI::Range(0, 10000))
        ->capture_default_str();
    command->add_flag("--json", options->json, "Print JSON");
    command->add_flag("--quiet", options->quiet, "No progress bar");
    command->footer(
        "Times are of the library alone: the frames lie in memory, one is in flight at a time. The sequence is\n"
        "run twice: as an application runs it, and for the stages' times with a wait after each.\n"
        "\n"
        "Examples:\n"
        "  defrec bench --threads 2\n"
        "  defrec bench --size 360x288 --backend reference --frames 20");
    command->callback([options, &run] { run = [options] { return run_bench(*options); }; });
    return command;
}

}  // namespace defrec::cli
