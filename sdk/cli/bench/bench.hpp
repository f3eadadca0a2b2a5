// How long a frame takes on a device, stage by stage, on frames held in memory.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sdk/client/library.hpp"

namespace defrec::cli {

struct BenchSequence {
    std::string name;  // of the scene or of the user's files
    StereoCalibration calibration;
    std::vector<StereoFrame> frames;
};

struct BenchOptions {
    std::string scene = "heartbeat";
    int width = 960, height = 540, filmed = 16;  // of the scene, and how many of its frames
    int frames = 100, warm_up = 10;
    int trackers = 1;     // more: they are measured at once, too, each on a thread of its own
    bool spread = false;  // those over all devices of the backend
    int beneath = 0;      // more: so many targets are moved by the body beneath the surface, too
    bool stages = true;   // false: only from submission to result
    std::uint64_t deadline_ns = 0;  // of each frame, from its submission; 0: none
    std::string config;             // YAML with parameters of the tracker, or empty
    std::string backend = "auto", device;
    unsigned threads = 0;
    bool json = false, quiet = false;
};

// The scene, filmed into memory. Throws CliError.
BenchSequence filmed_sequence(const BenchOptions& options);

// Costs of the elastic body beneath the surface.
struct BodyTimes {
    double ready_ms = 0;   // from when it was asked for; to within a frame
    double memory_mb = 0;  // that the process grew by at the peak meanwhile
    // From submission to result: without a body, while it is computed, and with it.
    std::vector<double> without_ms, meanwhile_ms, with_ms;
    std::size_t targets = 0, points = 0;
    std::vector<double> targets_ms, points_ms;  // prepared ones, and arbitrary ones, in a frame
};

struct BenchTimes {
    Device device;
    std::vector<std::pair<std::string, std::vector<double>>>
        stages_ms;  // in order of execution, each frame's; the host waits after each
    std::vector<double> stages_together_ms;  // of the same frames
    std::vector<double>
        latency_ms;  // from submission to result, of frames between which nothing waits
    std::vector<double>
        at_once_latency_ms;  // of all frames of all trackers, where several were asked for
    double at_once_ms = 0;   // that those frames took together
    std::map<std::string, int> at_once_trackers;  // by the id of their device
    std::size_t tracked_frames = 0;
    std::array<std::size_t, 3> short_frames{};  // of these: coarse, unchecked, overdue
    std::optional<BodyTimes> body;
    double tracker_memory_mb = 0;  // what context and tracker added to the process at their peak
};

// Plays the sequence to and fro, twice: as an application runs it, and (with options.stages) with a
// wait after each stage; then to several trackers at once. Fewer frames than asked for after an
// interruption. Throws CliError.
BenchTimes measure_times(const BenchOptions& options, const BenchSequence& sequence);

nlohmann::ordered_json spread_of(const std::vector<double>& ms);
// What bench_json says of the sequence: its `size` and name.
nlohmann::ordered_json sequence_json(const BenchSequence& sequence);
nlohmann::ordered_json bench_json(const BenchOptions& options, const BenchSequence& sequence,
                                  const BenchTimes& times);
// The same for people.
std::string bench_text(const nlohmann::ordered_json& json);

}  // namespace defrec::cli
