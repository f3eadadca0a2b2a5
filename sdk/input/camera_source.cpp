// Images of one or two cameras as they come.
#include "sdk/input/camera_source.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

#include "sdk/input/camera_name.hpp"
#include "sdk/input/pipeline.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kLookAround = 50ms;
// Without an image for that long a camera has stopped.
constexpr auto kMaxSilence = 3s;
// A camera that was just started may take longer.
constexpr auto kMaxStart = 10s;
constexpr auto kPause = 500ms;  // between attempts to start
constexpr double kDefaultFps = 30;

double seconds_since(Clock::time_point time) {
    return std::chrono::duration<double>(Clock::now() - time).count();
}

}  // namespace

struct CameraSource::Impl {
    CameraOptions options;
    std::function<void(const std::string&)> notify = [](const std::string&) {};
    std::string fault;
    double last_ms = -1;
    double longest_gap_ms = 0;
    std::int64_t reconnections = 0;
    std::optional<Clock::time_point> stopped;  // when the camera was lost; empty while it delivers
    Clock::time_point silent_since;            // the last image, or the start
    Clock::time_point retry;                   // when to start again

    mutable std::mutex mutex;  // of the next three
    std::condition_variable has_news;
    FramePairs pairs;
    double fps = 0;

    std::unique_ptr<Pipeline> pipeline;  // ends before what it writes to; null between attempts

    void start() {
        {
            const std::lock_guard lock(mutex);
            pairs.clear();
        }
        silent_since = Clock::now();
        pipeline = std::make_unique<Pipeline>(options.cameras,
                                              [this](std::size_t camera, Pipeline::Image image) {
                                                  receive(camera, std::move(image));
                                              });
    }

    void receive(std::size_t camera, Pipeline::Image image) {
        {
            const std::lock_guard lock(mutex);
            if (camera == 0 && image.fps > 0) fps = image.fps;
            const double rate = fps > 0 ? fps : options.fps > 0 ? options.fps : kDefaultFps;
            pairs.set_tolerance(0.5 * 1000 / rate);
            if (options.cameras.size() == 1)
                pairs.add_pair({std::move(image.image), {}});
            else
                pairs.add(camera == 0 ? FramePairs::View::kLeft : FramePairs::View::kRight,
                          std::move(image.image));
        }
        has_news.notify_one();
    }

    std::optional<CameraPair> wait_for_pair() {
        std::unique_lock lock(mutex);
        std::optional<CameraPair> pair = pairs.take();
        if (pair) return pair;
        has_news.wait_for(lock, kLookAround);
        return pairs.take();
    }

    // Empty while images may still come.
    std::string problem() {
        if (std::string error = pipeline->take_error(); !error.empty()) return error;
        if (pipeline->has_ended()) return is_endless() ? "it has ended" : "";
        const auto limit = stopped || last_ms < 0 ? Clock::duration(kMaxStart) : kMaxSilence;
        if (Clock::now() - silent_since < limit) return "";
        return "no newer image came for " +
               format_fixed(std::chrono::duration<double>(limit).count(), 0) + " s";
    }

    std::string names() const {
        std::string text = shown_source(options.cameras.front());
        for (std::size_t i = 1; i < options.cameras.size(); ++i)
            text += " and " + shown_source(options.cameras[i]);
        return text;
    }

    // A pipeline of the user's own ends when it has delivered everything; an address or a device is
    // there for ever.
    bool is_endless() const {
        return std::none_of(options.cameras.begin(), options.cameras.end(), [](const auto& name) {
            return parse_camera(name).kind == CameraName::Kind::kPipeline;
        });
    }

    // False when there is nothing more to try.
    bool stop(const std::string& why) {
        pipeline.reset();
        if (last_ms < 0) throw CliError(ExitCode::kInput, names() + ": " + why + ".");
        if (!stopped) {
            stopped = Clock::now();
            notify("the camera stopped (" + why + "); trying to start it again.");
        }
        if (seconds_since(*stopped) >= options.reconnect_seconds) {
            fault = names() + ": the camera stopped and did not come back within " +
                    format_fixed(options.reconnect_seconds, 0) + " s: " + why + ".";
            return false;
        }
        retry = Clock::now() + kPause;
        return true;
    }

    bool restart() {
        if (Clock::now() < retry) return true;
        try {
            start();
        } catch (const CliError& error) {
            return stop(error.what());
        }
        return true;
    }

    void accept(const CameraPair& pair) {
        if (last_ms >= 0) longest_gap_ms = std::max(longest_gap_ms, pair.left.time_ms - last_ms);
        last_ms = pair.left.time_ms;
        silent_since = Clock::now();
        if (!stopped) return;
        ++reconnections;
        notify("the camera is back after " + format_fixed(seconds_since(*stopped), 1) + " s.");
        stopped.reset();
    }
};

CameraSource::CameraSource(const CameraOptions& options) : impl_(std::make_unique<Impl>()) {
    impl_->options = options;
    impl_->start();
}

CameraSource::~CameraSource() = default;

bool CameraSource::read(CameraPair& pair) {
    Impl& impl = *impl_;
    while (impl.fault.empty() && !interrupt_requested()) {
        // Asked before the images are: what ended has delivered its last one.
        const bool has_ended = impl.pipeline && impl.pipeline->has_ended();
        std::optional<CameraPair> newest = impl.wait_for_pair();
        if (newest && newest->left.time_ms > impl.last_ms) {
            impl.accept(*newest);
            pair = std::move(*newest);
            return true;
        }
        if (!impl.pipeline) {
            if (!impl.restart()) return false;
            continue;
        }
        // Asked first: after an error, which is reported before, a pipeline ends as well.
        if (const std::string problem = impl.problem(); !problem.empty()) {
            if (!impl.stop(problem)) return false;
        } else if (has_ended && !impl.is_endless()) {
            return false;
        }
    }
    return false;
}

const std::string& CameraSource::fault() const { return impl_->fault; }

double CameraSource::fps() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->fps;
}

CameraCounts CameraSource::counts() const {
    const std::lock_guard lock(impl_->mutex);
    return {impl_->pairs.counts(), impl_->reconnections, impl_->longest_gap_ms};
}

void CameraSource::set_notice_handler(std::function<void(const std::string&)> handler) {
    impl_->notify = std::move(handler);
}

}  // namespace defrec::cli
