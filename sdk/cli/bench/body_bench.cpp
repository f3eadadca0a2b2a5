// See body_bench.hpp.
#include "sdk/cli/bench/body_bench.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/cli/bench/player.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/process_memory.hpp"
#include "sdk/io/statistics.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kPoints = 1000;

Template template_of(const Player& player) {
    defrec_template handle = nullptr;
    require(defrec_job_get_template(player.job().get(), &handle), ExitCode::kInternal,
            "reading the template");
    return Template(handle);
}

// Points 2 to 40 mm beneath the template's vertices, along their lines of sight.
std::vector<double> points_beneath(const Template& surface, std::size_t count) {
    auto info = initialised<defrec_template_info>();
    require(defrec_template_get(surface.get(), &info), ExitCode::kInternal, "reading the template");
    constexpr double kFirstMm = 2, kRangeMm = 38, kGolden = 0.6180339887498949;
    std::vector<double> xyz;
    for (std::size_t i = 0; i < count; ++i) {
        const float* vertex = info.vertices[i * info.vertex_count / count].position;
        const double depth = kFirstMm + kRangeMm * std::fmod(kGolden * static_cast<double>(i), 1.0),
                     z = static_cast<double>(vertex[2]);
        for (int axis = 0; axis < 3; ++axis)
            xyz.push_back(static_cast<double>(vertex[axis]) * (z + depth) / z);
    }
    return xyz;
}

void add_frames(Player& player, int count, std::vector<double>& ms) {
    for (int i = 0; i < count && !interrupt_requested(); ++i) ms.push_back(player.play());
}

Targets prepare(const Template& surface, const std::vector<double>& xyz) {
    defrec_targets handle = nullptr;
    require(defrec_targets_create(surface.get(), xyz.data(), xyz.size() / 3, &handle),
            ExitCode::kInternal, "preparing targets");
    return Targets(handle);
}

// The time of one call for the points of a new frame.
template <class Ask>
void add_calls(Player& player, int count, std::vector<double>& ms, Ask&& ask) {
    for (int i = 0; i < count && !interrupt_requested(); ++i) {
        player.play();
        const BenchClock::time_point start = BenchClock::now();
        require(ask(player.job().get()), ExitCode::kInternal, "moving points");
        ms.push_back(milliseconds_since(start));
    }
}

}  // namespace

BodyTimes measure_body(const BenchOptions& options, const BenchSequence& sequence) {
    BodyTimes times;
    BenchSetup setup = make_setup(options, sequence);
    setup.desc.body = DEFREC_BODY_OFF;  // until it is asked for
    Player player(options, sequence, setup);
    std::vector<double> warm_up;
    add_frames(player, std::max(options.warm_up, 1), warm_up);
    add_frames(player, options.frames, times.without_ms);
    if (interrupt_requested()) return times;

    const Template surface = template_of(player);
    reset_peak_memory();
    const double before = resident_megabytes();
    const BenchClock::time_point start = BenchClock::now();
    require(defrec_template_set_body(surface.get(), nullptr), ExitCode::kInternal,
            "asking for the body");
    while (!interrupt_requested()) {
        const defrec_status status = defrec_template_wait_body(surface.get(), 0);
        require(status, ExitCode::kInternal, "computing the body");
        if (status == DEFREC_OK) break;
        times.meanwhile_ms.push_back(player.play());
    }
    times.ready_ms = milliseconds_since(start);
    times.memory_mb = peak_megabytes() - before;
    add_frames(player, options.frames, times.with_ms);

    const std::vector<double> plan =
        points_beneath(surface, static_cast<std::size_t>(options.beneath));
    const std::vector<double> some = points_beneath(surface, kPoints);
    const Targets prepared = prepare(surface, plan);
    times.targets = plan.size() / 3;
    times.points = kPoints;
    std::vector<double> xyz(std::max(plan.size(), some.size())), errors(xyz.size() / 3);
    std::vector<std::uint8_t> status(xyz.size() / 3);
    add_calls(player, options.frames, times.targets_ms, [&](defrec_job job) {
        return defrec_job_move_targets(job, prepared.get(), times.targets, xyz.data(), nullptr,
                                       status.data(), errors.data());
    });
    add_calls(player, options.frames, times.points_ms, [&](defrec_job job) {
        return defrec_job_warp_points(job, some.data(), times.points, xyz.data(), status.data(),
                                      errors.data());
    });
    return times;
}

Json body_json(const BodyTimes& times) {
    return {{"ready_ms", times.ready_ms},
            {"memory_mb", times.memory_mb},
            {"frames_meanwhile", times.meanwhile_ms.size()},
            {"frame_without", spread_of(times.without_ms)},
            {"frame_meanwhile", spread_of(times.meanwhile_ms)},
            {"frame_with", spread_of(times.with_ms)},
            {"targets", times.targets},
            {"move_targets", spread_of(times.targets_ms)},
            {"points", times.points},
            {"warp_points", spread_of(times.points_ms)}};
}

}  // namespace defrec::cli
