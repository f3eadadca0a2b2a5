// See soak.hpp.
#include "sdk/cli/soak/soak.hpp"

#include <malloc.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "sdk/io/interrupt.hpp"
#include "sdk/io/process_memory.hpp"
#include "sdk/io/statistics.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kFrameSeconds = 1.0 / 30;
// How often things happen, in frames.
constexpr int kFramesPerCut = 200, kFramesPerLoss = 300, kFramesPerGap = 500,
              kFramesPerTemplate = 250, kFramesOfLoss = 10;
constexpr int kShortestLife = 5, kLongestLife = 60;  // of a player's tracker, in frames
constexpr int kTrackersPerContext = 100;

// What all threads count, of one interval or of the whole run.
struct Counts {
    std::uint64_t frames = 0, lost = 0, trackers = 0, cuts = 0, losses = 0, gaps = 0, templates = 0,
                  growths = 0, lost_devices = 0;
    std::vector<double> latency_ms;     // of the tracker that lives as long as the run
    std::vector<double> loop_error_mm;  // its own
};

class Run {
  public:
    explicit Run(const SoakOptions& options)
        : options_(options),
          sequence_(filmed_sequence(options.bench)),
          black_(sequence_.frames.front()) {
        const std::size_t size = black_.left.stride * static_cast<std::size_t>(black_.left.height);
        auto pixels = std::make_shared<std::vector<std::uint8_t>>(size);
        black_.left.pixels = black_.right.pixels = pixels->data();
        black_.pixels = std::move(pixels);
    }

    const SoakOptions& options() const { return options_; }
    const BenchSequence& sequence() const { return sequence_; }
    const StereoFrame& black() const { return black_; }

    bool is_over() const { return is_over_ || interrupt_requested(); }
    void end() { is_over_ = true; }
    // A signal wakes nobody.
    void rest_until(Clock::time_point due) const {
        constexpr std::chrono::milliseconds kLook{100};
        while (!is_over() && Clock::now() < due)
            std::this_thread::sleep_until(std::min(due, Clock::now() + kLook));
    }

    template <class Change>
    void count(Change&& change) {
        const std::lock_guard lock(mutex_);
        change(counts_);
    }
    Counts take_counts() {
        const std::lock_guard lock(mutex_);
        return std::exchange(counts_, {});
    }

    // Runs body in a thread; what it throws ends the run.
    std::thread start(std::function<void()> body) {
        return std::thread([this, body = std::move(body)] {
            try {
                body();
            } catch (...) {
                const std::lock_guard lock(mutex_);
                if (failure_ == nullptr) failure_ = std::current_exception();
                is_over_ = true;
            }
        });
    }
    void throw_failure() const {
        if (failure_ != nullptr) std::rethrow_exception(failure_);
    }

  private:
    const SoakOptions& options_;
    const BenchSequence sequence_;
    StereoFrame black_;
    std::atomic<bool> is_over_ = false;
    std::mutex mutex_;
    Counts counts_;
    std::exception_ptr failure_;
};

// What trackers are made of.
struct Origin {
    Context context;
    Rig rig;
    Device device;

    explicit Origin(const Run& run)
        : context(open_context({run.options().bench.threads, false, {}})),
          rig(make_rig(context, run.sequence().calibration)),
          device(choose_device(context, run.options().bench.backend, run.options().bench.device)) {}

    Tracker make_tracker(Run& run) const {
        auto desc = initialised<defrec_tracker_desc>();
        desc.device_id = device.id.c_str();
        desc.grow = run.options().grows ? 1 : 0;
        defrec_tracker handle = nullptr;
        require(defrec_tracker_create(context.get(), rig.get(), &desc, &handle),
                ExitCode::kInternal, "creating a tracker");
        run.count([](Counts& counts) { ++counts.trackers; });
        return Tracker(handle);
    }
};

// A tracker, the sequence that is played to it to and fro, and what happens to it on the way.
class Player {
  public:
    Player(Run& run, const Origin& origin, std::uint64_t seed)
        : run_(run), random_(seed), tracker_(origin.make_tracker(run)) {}

    Job play() {
        StereoFrame frame = next_frame();
        defrec_image left = image_of(frame.left), right = image_of(frame.right);
        auto desc = initialised<defrec_frame>();
        desc.timestamp_ns = std::llround(time_s_ * 1e9);
        desc.flags = is_new_template_ ? DEFREC_FRAME_CAPTURE_TEMPLATE : 0;
        desc.left = &left;
        desc.right = &right;
        defrec_job job = nullptr;
        require(defrec_tracker_submit(tracker_.get(), &desc, &job), ExitCode::kInternal,
                "submitting a frame");
        return Job(job);
    }

    // Waits for the frame that play() gave.
    defrec_result result(const Job& job) {
        require(defrec_job_wait(job.get(), UINT64_MAX), ExitCode::kInternal, "tracking a frame");
        auto result = initialised<defrec_result>();
        require(defrec_job_result(job.get(), &result), ExitCode::kInternal, "reading a result");
        run_.count([&](Counts& counts) {
            ++counts.frames;
            counts.lost += result.state == DEFREC_LOST || result.state == DEFREC_INITIALISING;
            counts.growths += (result.reasons & DEFREC_REASON_TEMPLATE_GREW) != 0 ? 1 : 0;
        });
        return result;
    }

    // How far the surface lies from where the same image had it before, mean in mm; negative where
    // that cannot be said.
    double loop_error_mm(const defrec_result& result) {
        if (place_ != 0 || loss_left_ > 0) return -1;
        if (result.state == DEFREC_LOST || result.vertex_count == 0) return -1;
        if (result.template_epoch != epoch_) {
            epoch_ = result.template_epoch;
            first_.assign(result.vertices, result.vertices + 3 * result.vertex_count);
            return -1;
        }
        double sum = 0;
        std::size_t count = 0;
        for (std::size_t i = 0; i < result.vertex_count; ++i) {
            if (result.vertex_status[i] != DEFREC_POINT_OBSERVED) continue;
            double squares = 0;
            for (std::size_t axis = 3 * i; axis < 3 * i + 3; ++axis)
                squares += (result.vertices[axis] - first_[axis]) *
                           static_cast<double>(result.vertices[axis] - first_[axis]);
            sum += std::sqrt(squares);
            ++count;
        }
        return count > 0 ? sum / static_cast<double>(count) : -1;
    }

  private:
    bool happens_once_in(int frames) {
        return std::uniform_int_distribution(0, frames - 1)(random_) == 0;
    }

    StereoFrame next_frame() {
        const auto count = static_cast<int>(run_.sequence().frames.size());
        const int length = 2 * (count - 1);
        step_ = (step_ + 1) % length;
        time_s_ += kFrameSeconds;
        if (happens_once_in(kFramesPerCut)) {
            step_ = std::uniform_int_distribution(0, length - 1)(random_);
            run_.count([](Counts& counts) { ++counts.cuts; });
        }
        if (happens_once_in(kFramesPerGap)) {
            time_s_ += 15 * kFrameSeconds;
            run_.count([](Counts& counts) { ++counts.gaps; });
        }
        if (loss_left_ > 0) {
            --loss_left_;
        } else if (happens_once_in(kFramesPerLoss)) {
            loss_left_ = kFramesOfLoss;
            run_.count([](Counts& counts) { ++counts.losses; });
        }
        place_ = step_ < count ? step_ : length - step_;
        wants_template_ = wants_template_ || happens_once_in(kFramesPerTemplate);
        is_new_template_ = wants_template_ && place_ == 0 && loss_left_ == 0;
        if (is_new_template_) {
            wants_template_ = false;
            run_.count([](Counts& counts) { ++counts.templates; });
        }
        return loss_left_ > 0 ? run_.black()
                              : run_.sequence().frames[static_cast<std::size_t>(place_)];
    }

    Run& run_;
    std::mt19937_64 random_;
    Tracker tracker_;
    std::vector<float> first_;  // the vertices where place_ was 0 for the first time
    std::uint32_t epoch_ = 0;   // their template's
    double time_s_ = 0;
    int step_ = -1, place_ = 0, loss_left_ = 0;
    bool wants_template_ = false, is_new_template_ = false;
};

// Waits until the next frame is due; a player that is late goes on at once, without catching up.
class Pace {
  public:
    explicit Pace(double speed) : speed_(speed) {}
    void wait() {
        if (speed_ <= 0) return;
        due_ = std::max(due_ + std::chrono::duration_cast<Clock::duration>(
                                   std::chrono::duration<double>(kFrameSeconds / speed_)),
                        Clock::now() - std::chrono::milliseconds(1));
        std::this_thread::sleep_until(due_);
    }

  private:
    double speed_;
    Clock::time_point due_ = Clock::now();
};

void play_on(Run& run, const Origin& origin) {
    Player player(run, origin, 1);
    Pace pace(run.options().speed);
    while (!run.is_over()) {
        pace.wait();
        const Clock::time_point start = Clock::now();
        const Job job = player.play();
        const defrec_result result = player.result(job);
        const double ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
        const double error_mm = player.loop_error_mm(result);
        run.count([&](Counts& counts) {
            counts.latency_ms.push_back(ms);
            if (error_mm >= 0) counts.loop_error_mm.push_back(error_mm);
        });
    }
}

// About every other tracker is destroyed with a frame under way, whose job outlives it.
void play_lives(Run& run, const Origin& origin, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    Pace pace(run.options().speed);
    while (!run.is_over()) {
        const int life = std::uniform_int_distribution(kShortestLife, kLongestLife)(random);
        Job job;
        Player player(run, origin, random());
        for (int frame = 0; frame < life && !run.is_over(); ++frame) {
            pace.wait();
            job.reset();
            job = player.play();
            if (frame + 1 < life || life % 2 == 0) player.result(job);
        }
    }
}

void make_trackers(Run& run) {
    Pace pace(run.options().trackers_per_s * kFrameSeconds);
    while (!run.is_over()) {
        const Origin origin(run);
        for (int i = 0; i < kTrackersPerContext && !run.is_over(); ++i) {
            pace.wait();
            origin.make_tracker(run);
        }
    }
}

// Each second a device is lost, in a context of its own.
void lose_devices(Run& run) {
    auto params = initialised<defrec_ransac_params>();
    params.landmarks = 10;
    std::array<std::byte, 40> given{}, taken{};
    const defrec_const_buffer in{given.data(), given.size()};
    const defrec_buffer out{taken.data(), taken.size()};
    Pace pace(kFrameSeconds);
    while (!run.is_over()) {
        pace.wait();
        const Context context =
            open_context({1, true, {run.options().losing_plugin}, nullptr, nullptr, true});
        defrec_stage handle = nullptr;
        require(defrec_stage_create(context.get(), nullptr, DEFREC_STAGE_RANSAC, &params, &handle),
                ExitCode::kInternal, "creating a stage");
        const std::unique_ptr<defrec_stage_, decltype(&defrec_stage_destroy)> stage(
            handle, &defrec_stage_destroy);
        require(defrec_stage_prepare(stage.get(), nullptr, 0), ExitCode::kInternal,
                "preparing a stage");
        if (defrec_stage_run(stage.get(), &in, 1, &out, 1) != DEFREC_ERROR_DEVICE_LOST)
            throw CliError(ExitCode::kInternal, "the plugin did not lose its device");
        run.count([](Counts& counts) { ++counts.lost_devices; });
    }
}

std::size_t entries_of(const char* folder) {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

double heap_megabytes() {
    const auto info = ::mallinfo2();
    return static_cast<double>(info.uordblks + info.hblkhd) / 1e6;
}

void print_line(double second, const Counts& counts) {
    const auto number = [](const std::vector<double>& values, double share) {
        return values.empty() ? std::string() : format_fixed(nearest_rank(values, share), 4);
    };
    std::string line = format_fixed(second, 3);
    for (const std::uint64_t value :
         {counts.frames, counts.lost, counts.trackers, counts.cuts, counts.losses, counts.gaps,
          counts.templates, counts.growths, counts.lost_devices})
        line.append(",").append(std::to_string(value));
    line.append(",").append(number(counts.latency_ms, 0.99));
    line.append(",").append(number(counts.loop_error_mm, 0.5));
    line.append(",").append(format_fixed(resident_megabytes(), 3));
    line.append(",").append(format_fixed(heap_megabytes(), 3));
    line.append(",").append(std::to_string(entries_of("/proc/self/fd")));
    line.append(",").append(std::to_string(entries_of("/proc/self/task")));
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
}

}  // namespace

void soak(const SoakOptions& options) {
    Run run(options);
    const Origin origin(run);
    std::printf(
        "second,frames,lost,trackers,cuts,losses,gaps,templates,growths,lost_devices,p99_ms,"
        "loop_error_mm,"
        "resident_mb,heap_mb,descriptors,threads\n");
    std::vector<std::thread> threads;
    threads.push_back(run.start([&] { play_on(run, origin); }));
    for (int i = 0; i < options.players; ++i)
        threads.push_back(
            run.start([&, i] { play_lives(run, origin, static_cast<std::uint64_t>(i) + 2); }));
    if (!options.losing_plugin.empty()) threads.push_back(run.start([&] { lose_devices(run); }));
    if (options.trackers_per_s > 0) threads.push_back(run.start([&] { make_trackers(run); }));

    const Clock::time_point start = Clock::now();
    for (int line = 1; !run.is_over(); ++line) {
        using Seconds = std::chrono::duration<double>;
        const Seconds due(line * options.interval_s);
        run.rest_until(start + std::chrono::duration_cast<Clock::duration>(due));
        const Seconds second = std::min<Seconds>(due, Clock::now() - start);
        print_line(second.count(), run.take_counts());
        if (second.count() >= 60 * options.minutes) run.end();
    }
    for (std::thread& thread : threads) thread.join();
    run.throw_failure();
}

}  // namespace defrec::cli
