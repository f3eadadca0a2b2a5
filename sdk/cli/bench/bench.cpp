// See bench.hpp.
#include "sdk/cli/bench/bench.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <thread>

#include "sdk/cli/bench/body_bench.hpp"
#include "sdk/cli/bench/player.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/process_memory.hpp"
#include "sdk/io/statistics.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"
#include "sdk/scenes/film.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kSeed = 1;
// Reasons of frames whose time was short.
constexpr std::array kShortReasons = {DEFREC_REASON_COARSE, DEFREC_REASON_UNCHECKED,
                                      DEFREC_REASON_OVERDUE};

CameraCalibration camera_of(const Lens& lens) {
    return {lens.fx,
            lens.fy,
            lens.cx,
            lens.cy,
            {lens.distortion.begin(), lens.distortion.end()},
            "the scene's camera",
            {}};
}

StereoCalibration calibration_of(const StereoRig& rig) {
    StereoCalibration calibration;
    calibration.width = rig.width;
    calibration.height = rig.height;
    calibration.left = camera_of(rig.left);
    calibration.right = camera_of(rig.right);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            calibration.rotation[static_cast<std::size_t>(3 * row + column)] =
                rig.rotation(row, column);
        calibration.translation[static_cast<std::size_t>(row)] = rig.translation[row];
    }
    return calibration;
}

// One run over the sequence; calls measured(latency in ms, result) for each frame behind the
// warm-up.
template <class Measured>
void run_tracker(const BenchOptions& options, const BenchSequence& sequence, bool timed,
                 Device& device, Measured&& measured) {
    const BenchSetup setup = make_setup(options, sequence);
    device = setup.device;
    Player player(options, sequence, setup, timed);
    ProgressBar progress(options.quiet);
    const int total = options.warm_up + options.frames;
    for (int step = 0; step < total && !interrupt_requested(); ++step) {
        const double latency = player.play();
        progress.update(step + 1, total, step < options.warm_up ? "warming up" : "measuring");
        if (step >= options.warm_up) measured(latency, player.result());
    }
}

// Plays `frames` frames to each, all at once; their latencies. Throws what the first of them threw
// that failed.
std::vector<double> play_at_once(std::vector<Player>& players, int frames) {
    std::vector<std::vector<double>> latencies(players.size());
    std::vector<std::exception_ptr> failures(players.size());
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < players.size(); ++i)
        threads.emplace_back([&, i] {
            try {
                for (int frame = 0; frame < frames && !interrupt_requested(); ++frame)
                    latencies[i].push_back(players[i].play());
            } catch (...) {
                failures[i] = std::current_exception();
            }
        });
    for (std::thread& thread : threads) thread.join();
    for (const std::exception_ptr& failure : failures)
        if (failure != nullptr) std::rethrow_exception(failure);
    std::vector<double> all;
    for (const std::vector<double>& some : latencies)
        all.insert(all.end(), some.begin(), some.end());
    return all;
}

void run_trackers_at_once(const BenchOptions& options, const BenchSequence& sequence,
                          BenchTimes& times) {
    BenchSetup setup = make_setup(options, sequence);
    if (options.spread) setup.device.id = backend_of(setup.device) + ":*";
    std::vector<Player> players;
    for (int i = 0; i < options.trackers; ++i) players.emplace_back(options, sequence, setup);
    play_at_once(players, options.warm_up);
    const BenchClock::time_point start = BenchClock::now();
    times.at_once_latency_ms = play_at_once(players, options.frames);
    times.at_once_ms = milliseconds_since(start);
    if (interrupt_requested()) return;
    for (const Player& player : players) ++times.at_once_trackers[player.result().device_id];
}

void add_stages(const defrec_result& result, BenchTimes& times) {
    double together = 0;
    for (std::uint32_t i = 0; i < result.time_count; ++i) {
        const auto same = [&](const auto& stage) { return stage.first == result.times[i].name; };
        auto stage = std::find_if(times.stages_ms.begin(), times.stages_ms.end(), same);
        if (stage == times.stages_ms.end())
            stage = times.stages_ms.insert(stage, {result.times[i].name, {}});
        stage->second.push_back(result.times[i].milliseconds);
        together += result.times[i].milliseconds;
    }
    times.stages_together_ms.push_back(together);
}

// For which rates of cameras a frame is done before the next one comes.
std::string fast_enough_text(const Json& submit_to_result) {
    const double median = submit_to_result["median_ms"].get<double>(),
                 p99 = submit_to_result["p99_ms"].get<double>();
    std::string text = "fast enough for";
    for (const int rate : {25, 30, 60}) {
        const double period = 1000.0 / rate;
        text += (rate == 25 ? " " : "; ") + std::to_string(rate) + " frames/s: ";
        text += p99 <= period      ? "yes"
                : median <= period ? "by the median, not by the 99th percentile"
                                   : "no";
    }
    return text + "\n";
}

Film make_film(const BenchOptions& options) try {
    return Film(options.scene, options.width, options.height, options.filmed, kSeed,
                static_cast<int>(options.threads));
} catch (const RenderUsageError& refusal) {
    throw CliError(ExitCode::kUsage, std::string("--scene: ") + refusal.what());
}

}  // namespace

Json spread_of(const std::vector<double>& ms) {
    return {{"min_ms", nearest_rank(ms, 0)},    {"median_ms", nearest_rank(ms, 0.5)},
            {"p99_ms", nearest_rank(ms, 0.99)}, {"p999_ms", nearest_rank(ms, 0.999)},
            {"max_ms", nearest_rank(ms, 1)},    {"noise_ms", median_noise(ms)}};
}

BenchSequence filmed_sequence(const BenchOptions& options) {
    Film film = make_film(options);
    BenchSequence sequence{options.scene, calibration_of(film.scene().rig), {}};
    ProgressBar progress(options.quiet);
    for (int i = 0; i < options.filmed; ++i) {
        film.advance();
        auto pixels = std::make_shared<std::vector<std::uint8_t>>(film.left_bgr());
        pixels->insert(pixels->end(), film.right_bgr().begin(), film.right_bgr().end());
        const std::size_t stride = static_cast<std::size_t>(options.width) * 3;
        StereoFrame frame;
        frame.left = {pixels->data(), options.width, options.height, 3, stride};
        frame.right = {pixels->data() + film.left_bgr().size(), options.width, options.height, 3,
                       stride};
        frame.pixels = std::move(pixels);
        sequence.frames.push_back(std::move(frame));
        progress.update(i + 1, options.filmed, "rendering");
    }
    return sequence;
}

BenchTimes measure_times(const BenchOptions& options, const BenchSequence& sequence) {
    BenchTimes times;
    reset_peak_memory();
    const double before = resident_megabytes();
    run_tracker(options, sequence, false, times.device,
                [&](double latency, const defrec_result& result) {
                    times.latency_ms.push_back(latency);
                    times.tracked_frames +=
                        result.state != DEFREC_LOST && result.state != DEFREC_INITIALISING;
                    for (std::size_t i = 0; i < kShortReasons.size(); ++i)
                        times.short_frames[i] += (result.reasons & kShortReasons[i]) != 0;
                });
    times.tracker_memory_mb = peak_megabytes() - before;
    if (options.stages)
        run_tracker(options, sequence, true, times.device,
                    [&](double, const defrec_result& result) { add_stages(result, times); });
    if (options.trackers > 1 && !interrupt_requested())
        run_trackers_at_once(options, sequence, times);
    if (options.beneath > 0 && !interrupt_requested()) times.body = measure_body(options, sequence);
    return times;
}

Json sequence_json(const BenchSequence& sequence) {
    return {{"size", std::to_string(sequence.calibration.width) + "x" +
                         std::to_string(sequence.calibration.height)},
            {"sequence", sequence.name}};
}

Json bench_json(const BenchOptions& options, const BenchSequence& sequence,
                const BenchTimes& times) {
    const double median = nearest_rank(times.latency_ms, 0.5);
    Json json;
    json["defrec"] = defrec_version_string();
    json["device"] = {{"id", times.device.id}, {"name", times.device.name}};
    json["threads"] = options.threads;
    json.update(sequence_json(sequence));
    json["frames"] = times.latency_ms.size();
    json["tracked_frames"] = times.tracked_frames;
    json["stages"] = Json::object();
    for (const auto& [name, ms] : times.stages_ms) json["stages"][name] = spread_of(ms);
    if (options.stages) json["stages"]["frame"] = spread_of(times.stages_together_ms);
    json["submit_to_result"] = spread_of(times.latency_ms);
    if (options.deadline_ns != 0) {
        json["deadline_ms"] = 1e-6 * static_cast<double>(options.deadline_ns);
        for (std::size_t i = 0; i < kShortReasons.size(); ++i)
            json["short_frames"][reason_names(kShortReasons[i], "|")] = times.short_frames[i];
    }
    json["frames_per_second"] = median > 0 ? 1000 / median : 0;
    if (!times.at_once_latency_ms.empty())
        json["at_once"] = {
            {"trackers", options.trackers},
            {"devices", times.at_once_trackers},
            {"submit_to_result", spread_of(times.at_once_latency_ms)},
            {"frames_per_second",
             1000 * static_cast<double>(times.at_once_latency_ms.size()) / times.at_once_ms}};
    if (times.body) json["body"] = body_json(*times.body);
    json["peak_memory_mb"] = peak_megabytes();
    json["tracker_memory_mb"] = times.tracker_memory_mb;
    return json;
}

std::string bench_text(const Json& json) {
    const auto line = [](std::string name, const Json& times) {
        name.resize(std::max<std::size_t>(name.size(), 20), ' ');
        for (const char* value : {"min_ms", "median_ms", "p99_ms", "p999_ms", "max_ms"}) {
            const std::string text = format_fixed(times[value].get<double>(), 2);
            name.append(text.size() < 10 ? 10 - text.size() : 0, ' ').append(text);
        }
        return name + "\n";
    };
    std::string text =
        json["device"]["id"].get<std::string>() + ", " + json["size"].get<std::string>() + ", " +
        std::to_string(json["frames"].get<std::size_t>()) + " frames, " +
        std::to_string(json["tracked_frames"].get<std::size_t>()) + " of them tracked\n";
    text += "ms                         min    median       p99     p99.9     worst\n";
    for (const auto& [stage, times] : json["stages"].items()) {
        if (stage != "frame") text += line(stage, times);
    }
    if (json["stages"].contains("frame")) text += line("all stages", json["stages"]["frame"]);
    text += line("submit to result", json["submit_to_result"]);
    if (json.contains("short_frames")) {
        text += "deadline " + format_fixed(json["deadline_ms"].get<double>(), 2) + " ms:";
        for (const auto& [reason, frames] : json["short_frames"].items())
            text.append(" ")
                .append(std::to_string(frames.get<std::size_t>()))
                .append(" ")
                .append(reason);
        text += " frames\n";
    }
    if (json.contains("at_once")) {
        const Json& at_once = json["at_once"];
        const std::string trackers =
            std::to_string(at_once["trackers"].get<int>()) + " trackers at once";
        text += line(trackers, at_once["submit_to_result"]);
        text += trackers + ": " + format_fixed(at_once["frames_per_second"].get<double>(), 1) +
                " frames/s in all";
        if (at_once["devices"].size() > 1)
            for (const auto& [device, count] : at_once["devices"].items())
                text += ", " + std::to_string(count.get<int>()) + " of them on " + device;
        text += "; alone: ";
    }
    if (json.contains("body")) {
        const Json& body = json["body"];
        for (const auto& [name, times] : {std::pair{"without the body", "frame_without"},
                                          {"while it is made", "frame_meanwhile"},
                                          {"with the body", "frame_with"},
                                          {"prepared targets", "move_targets"},
                                          {"arbitrary points", "warp_points"}})
            text += line(name, body[times]);
        text += "the body is ready after " + format_fixed(body["ready_ms"].get<double>(), 0) +
                " ms and takes " + format_fixed(body["memory_mb"].get<double>(), 0) + " MB; " +
                std::to_string(body["targets"].get<std::size_t>()) + " targets, " +
                std::to_string(body["points"].get<std::size_t>()) + " points\n";
    }
    return text + format_fixed(json["frames_per_second"].get<double>(), 1) +
           " frames/s; peak memory " + format_fixed(json["peak_memory_mb"].get<double>(), 0) +
           " MB, of it tracker " + format_fixed(json["tracker_memory_mb"].get<double>(), 0) +
           " MB\n" + fast_enough_text(json["submit_to_result"]);
}

}  // namespace defrec::cli
