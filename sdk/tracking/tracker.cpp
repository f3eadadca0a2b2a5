// See tracker.hpp.
#include "sdk/tracking/tracker.hpp"

#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "sdk/base/os/platform.hpp"
#include "sdk/base/os/run_within.hpp"
#include "sdk/contract/enumerations.hpp"
#include "sdk/device/context.hpp"
#include "sdk/tracking/surface_registration.hpp"

namespace defrec {
namespace {

std::string describe(const defrec_camera& camera) {
    return concat("fx ", camera.fx, ", fy ", camera.fy, ", cx ", camera.cx, ", cy ", camera.cy,
                  " px, disparity offset ", camera.disparity_offset_px, " px and baseline ",
                  camera.baseline_mm, " mm");
}

// Throws Error(DEFREC_ERROR_ARGUMENT).
void expect_template_of_rig(const TemplateData& data, const Rig& rig) {
    const defrec_camera& camera = rig.camera();
    if (data.width != rig.width() || data.height != rig.height())
        fail(DEFREC_ERROR_ARGUMENT, "the template was taken from images of ", data.width, "x",
             data.height, ", the rig has ", rig.width(), "x", rig.height());
    const auto differ = [&](double a, double b) { return std::abs(a - b) > 1e-6 * camera.fx; };
    if (differ(data.camera.fx, camera.fx) || differ(data.camera.fy, camera.fy) ||
        differ(data.camera.cx, camera.cx) || differ(data.camera.cy, camera.cy) ||
        differ(data.camera.disparity_offset_px, camera.disparity_offset_px) ||
        std::abs(data.camera.baseline_mm - camera.baseline_mm) > 1e-6 * camera.baseline_mm)
        fail(DEFREC_ERROR_ARGUMENT, "the template was taken with ", describe(data.camera),
             ", the rig has ", describe(camera));
}

}  // namespace

// Made, used and destroyed by one thread, which alone is in the plugin's hands. Other threads call
// what is marked so.
class Tracker::Impl {
  public:
    Impl(const std::shared_ptr<JobMonitor>& monitor, std::shared_ptr<DeviceWatch> watch,
         std::shared_ptr<const Rig> rig, const TrackerSettings& settings)
        : rig_(std::move(rig)),
          settings_(settings),
          device_(monitor->device.open(std::move(watch))),
          frames_(device_, monitor, *rig_, settings_),
          registration_(rig_, device_, settings_, frames_) {}

    void work() {
        while (TrackerJob* job = frames_.take())
            if (frames_.is_stopped())
                registration_.cancel(*job);
            else
                registration_.compute(*job);
    }

    // Any thread.
    void stop() { frames_.stop(); }
    std::shared_ptr<Job> submit(FrameInput input) { return frames_.submit(std::move(input)); }
    std::shared_ptr<const Template> current_template() const {
        std::shared_ptr<const Template> surface = frames_.template_to_set();
        if (surface == nullptr) surface = registration_.current_template();
        if (surface == nullptr)
            fail(DEFREC_ERROR_STATE,
                 "the tracker has no template yet; submit a frame and wait for it, or set one");
        return surface;
    }
    void set_template(std::shared_ptr<const Template> surface) {
        expect_template_of_rig(surface->data(), *rig_);
        frames_.set_template(std::move(surface));
    }
    const std::shared_ptr<Device>& device() const { return device_; }
    const TrackerSettings& settings() const { return settings_; }
    const Rig& rig() const { return *rig_; }

  private:
    std::shared_ptr<const Rig> rig_;
    TrackerSettings settings_;
    std::shared_ptr<Device> device_;
    FrameQueue frames_;
    SurfaceRegistration
        registration_;  // goes before the frames, whose memory its device may still use
};

// The thread of an Impl, which is left behind where the plugin does not let it go.
class Tracker::Worker {
  public:
    Worker(const DeviceChoice& device, const std::shared_ptr<const Rig>& rig,
           const TrackerSettings& settings)
        : state_(std::make_shared<State>(device)) {
        thread_ =
            platform::start_thread([state = state_, rig, settings] { state->live(rig, settings); });
        std::unique_lock lock(state_->mutex);
        const auto outcome =
            state_->watch->wait_until(state_->changed, lock, DeviceWatch::Clock::time_point::max(),
                                      [&] { return state_->impl != nullptr || state_->has_ended; });
        impl_ = state_->impl;
        if (impl_ != nullptr) return;
        state_->is_left_behind = outcome == DeviceWatch::Outcome::kStuck;
        lock.unlock();
        if (outcome == DeviceWatch::Outcome::kStuck) {
            thread_.detach();
            throw state_->monitor->device.give_up(name_of_call());
        }
        thread_.join();
        std::rethrow_exception(state_->failure);
    }
    ~Worker() {
        impl_->stop();
        impl_.reset();
        std::unique_lock lock(state_->mutex);
        state_->impl.reset();
        state_->changed.notify_all();
        const auto outcome =
            state_->watch->wait_until(state_->changed, lock, DeviceWatch::Clock::time_point::max(),
                                      [&] { return state_->has_ended; });
        lock.unlock();
        if (outcome == DeviceWatch::Outcome::kDone) {
            thread_.join();
        } else {
            thread_.detach();
            state_->monitor->give_up(name_of_call());
        }
    }
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    Impl* operator->() const { return impl_.get(); }
    const DeviceChoice& device() const { return state_->monitor->device; }

  private:
    // What the thread and its owner share.
    struct State {
        explicit State(const DeviceChoice& device)
            : watch(std::make_shared<DeviceWatch>(device.services()->plugin_deadline())),
              monitor(std::make_shared<JobMonitor>(device, watch)) {}

        void live(const std::shared_ptr<const Rig>& rig, const TrackerSettings& settings) {
            watch->watch_this_thread();
            try {
                auto own = std::make_shared<Impl>(monitor, watch, rig, settings);
                std::unique_lock lock(mutex);
                if (!is_left_behind) {
                    impl = own;
                    changed.notify_all();
                    lock.unlock();
                    own->work();
                    // The last one to let it go is this thread.
                    lock.lock();
                    changed.wait(lock, [&] { return impl == nullptr; });
                }
            } catch (...) {
                failure = std::current_exception();
            }
            const std::lock_guard lock(mutex);
            has_ended = true;
            changed.notify_all();
        }

        const std::shared_ptr<DeviceWatch> watch;
        const std::shared_ptr<JobMonitor> monitor;
        std::mutex mutex;
        std::condition_variable changed;
        // Under the mutex.
        std::shared_ptr<Impl> impl;  // from its start until the owner lets it go
        bool has_ended = false;
        bool is_left_behind = false;  // before its start
        // Why it could not start; to be read after the end of the thread.
        std::exception_ptr failure;
    };

    const char* name_of_call() const {
        const char* call = state_->watch->stuck_in();
        return call != nullptr ? call : "a call that took too long";
    }

    std::shared_ptr<State> state_;
    std::shared_ptr<Impl> impl_;
    std::thread thread_;
};

Tracker::Tracker(const Context& context, const std::shared_ptr<const Rig>& rig,
                 const defrec_tracker_desc& desc) {
    const TrackerSettings settings = complete_settings(desc, *rig);
    DeviceSelection selection = context.choose_device(desc.device_id, kEveryStage);
    if ((desc.flags & DEFREC_TRACKER_FALLBACK) == 0)
        selection.devices.erase(
            selection.devices.begin() + static_cast<std::ptrdiff_t>(selection.equal),
            selection.devices.end());
    while (worker_ == nullptr) {
        loan_ = context.lend(selection);
        try {
            worker_ = std::make_unique<Worker>(loan_.device(), rig, settings);
        } catch (const Error& error) {
            if (selection.devices.empty()) throw;
            context.log(DEFREC_LOG_WARNING,
                        concat("device ", loan_.device().description().id,
                               " is passed over for the next one: ", error.what()));
        }
    }
}
Tracker::~Tracker() = default;

std::shared_ptr<Job> Tracker::submit(FrameInput input) {
    return (*worker_)->submit(std::move(input));
}

std::shared_ptr<const DeviceBuffer> Tracker::import_memory(uint32_t kind, void* address,
                                                           uint64_t size) const {
    const DeviceChoice& choice = worker_->device();
    const auto imported = std::make_shared<std::shared_ptr<const DeviceBuffer>>();
    const bool is_done =
        run_within(choice.services()->plugin_deadline(), [=, device = (*worker_)->device()] {
            *imported = std::make_shared<const DeviceBuffer>(
                DeviceBuffer::import(device, kind, address, size));
        });
    if (!is_done) throw choice.give_up("buffer_import");
    return *imported;
}
bool Tracker::can_use(const DeviceBuffer& memory) const {
    return memory.device() == (*worker_)->device();
}
std::shared_ptr<const Template> Tracker::current_template() const {
    return (*worker_)->current_template();
}
void Tracker::set_template(std::shared_ptr<const Template> surface) {
    (*worker_)->set_template(std::move(surface));
}
uint32_t Tracker::format() const { return (*worker_)->settings().format; }
uint32_t Tracker::memory_stride() const { return (*worker_)->settings().memory_stride; }
const Rig& Tracker::rig() const { return (*worker_)->rig(); }

}  // namespace defrec
