// See player.hpp.
#include "sdk/cli/bench/player.hpp"

#include <string>

#include "sdk/client/tracker_config.hpp"

namespace defrec::cli {
namespace {

constexpr double kFrameMs = 1000.0 / 30;

// 0 1 2 1 0 1 2 ... for three frames.
std::size_t to_and_fro(std::size_t step, std::size_t count) {
    if (count == 1) return 0;
    const std::size_t place = step % (2 * (count - 1));
    return place < count ? place : 2 * (count - 1) - place;
}

}  // namespace

double milliseconds_since(BenchClock::time_point start) {
    return std::chrono::duration<double, std::milli>(BenchClock::now() - start).count();
}

BenchSetup make_setup(const BenchOptions& options, const BenchSequence& sequence) {
    BenchSetup setup{open_context({options.threads, options.quiet, {}}),
                     {},
                     {},
                     initialised<defrec_tracker_desc>()};
    setup.device = choose_device(setup.context, options.backend, options.device);
    setup.rig = make_rig(setup.context, sequence.calibration);
    setup.desc.format = format_of_channels(sequence.frames.front().left.channels);
    setup.desc.frames_in_flight = 1;
    if (!options.config.empty()) read_config(options.config, setup.desc);
    return setup;
}

Player::Player(const BenchOptions& options, const BenchSequence& sequence, const BenchSetup& setup,
               bool timed)
    : sequence_(sequence), deadline_ns_(options.deadline_ns) {
    defrec_tracker_desc desc = setup.desc;
    desc.device_id = setup.device.id.c_str();
    desc.timed = timed ? 1 : 0;
    defrec_tracker handle = nullptr;
    require(defrec_tracker_create(setup.context.get(), setup.rig.get(), &desc, &handle),
            options.config.empty() ? ExitCode::kInternal : ExitCode::kUsage,
            "creating the tracker");
    tracker_ = Tracker(handle);
}

double Player::play() {
    StereoFrame frame =
        sequence_.frames[to_and_fro(static_cast<std::size_t>(step_), sequence_.frames.size())];
    frame.index = step_;
    frame.timestamp_ms = step_ * kFrameMs;
    job_.reset();
    const BenchClock::time_point start = BenchClock::now();
    job_ = submit(tracker_, frame, deadline_ns_);
    require(defrec_job_wait(job_.get(), UINT64_MAX), ExitCode::kInternal,
            "frame " + std::to_string(step_));
    ++step_;
    return milliseconds_since(start);
}

defrec_result Player::result() const {
    auto result = initialised<defrec_result>();
    require(defrec_job_result(job_.get(), &result), ExitCode::kInternal, "reading the result");
    return result;
}

}  // namespace defrec::cli
