// See tracker.hpp.
#include "sdk/tracking/tracker.hpp"

#include <cmath>
#include <thread>

#include "sdk/base/platform.hpp"
#include "sdk/device/context.hpp"
#include "sdk/tracking/surface_follower.hpp"

namespace defrec {
namespace {

constexpr uint32_t kAllStages = (1u << DEFREC_STAGE_COUNT_V1) - 1;

std::string describe(const defrec_camera& camera) {
    return concat("fx ", camera.fx, ", fy ", camera.fy, ", cx ", camera.cx, ", cy ", camera.cy,
                  " px and baseline ", camera.baseline_mm, " mm");
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
        std::abs(data.camera.baseline_mm - camera.baseline_mm) > 1e-6 * camera.baseline_mm)
        fail(DEFREC_ERROR_ARGUMENT, "the template was taken with ", describe(data.camera),
             ", the rig has ", describe(camera));
}

}  // namespace

class Tracker::Impl {
  public:
    Impl(std::shared_ptr<Context> context, std::shared_ptr<const Rig> rig,
         const defrec_tracker_desc& desc)
        : context_(std::move(context)),
          rig_(std::move(rig)),
          settings_(complete_settings(desc, *rig_)),
          device_(context_->open_device(desc.device_id, kAllStages)),
          frames_(device_, *rig_, settings_),
          follower_(rig_, device_, settings_, frames_) {
        worker_ = platform::start_thread([this] { work(); });
    }
    ~Impl() {
        frames_.stop();
        worker_.join();
    }

    std::shared_ptr<Job> submit(FrameInput input) { return frames_.submit(std::move(input)); }

    std::shared_ptr<const Template> current_template() const {
        std::shared_ptr<const Template> surface = frames_.template_to_set();
        if (surface == nullptr) surface = follower_.current_template();
        if (surface == nullptr)
            fail(DEFREC_ERROR_STATE,
                 "the tracker has no template yet; submit a frame and wait for it, or set one");
        return surface;
    }
    void set_template(std::shared_ptr<const Template> surface) {
        expect_template_of_rig(surface->data(), *rig_);
        frames_.set_template(std::move(surface));
    }

    std::shared_ptr<const DeviceBuffer> import_memory(uint32_t kind, void* address,
                                                      uint64_t size) const {
        return std::make_shared<const DeviceBuffer>(
            DeviceBuffer::import(device_, kind, address, size));
    }
    bool can_use(const DeviceBuffer& memory) const { return memory.device() == device_; }

    uint32_t format() const { return settings_.format; }
    uint32_t memory_stride() const { return settings_.memory_stride; }
    const Rig& rig() const { return *rig_; }

  private:
    void work() {
        while (TrackerJob* job = frames_.take())
            if (frames_.is_stopped())
                follower_.cancel(*job);
            else
                follower_.compute(*job);
    }

    std::shared_ptr<Context> context_;
    std::shared_ptr<const Rig> rig_;
    TrackerSettings settings_;
    std::shared_ptr<Device> device_;
    FrameQueue frames_;
    SurfaceFollower follower_;  // goes before the frames, whose memory its device may still use
    std::thread worker_;
};

Tracker::Tracker(std::shared_ptr<Context> context, std::shared_ptr<const Rig> rig,
                 const defrec_tracker_desc& desc)
    : impl_(std::make_unique<Impl>(std::move(context), std::move(rig), desc)) {}
Tracker::~Tracker() = default;
std::shared_ptr<Job> Tracker::submit(FrameInput input) { return impl_->submit(std::move(input)); }
std::shared_ptr<const DeviceBuffer> Tracker::import_memory(uint32_t kind, void* address,
                                                           uint64_t size) const {
    return impl_->import_memory(kind, address, size);
}
bool Tracker::can_use(const DeviceBuffer& memory) const { return impl_->can_use(memory); }
std::shared_ptr<const Template> Tracker::current_template() const {
    return impl_->current_template();
}
void Tracker::set_template(std::shared_ptr<const Template> surface) {
    impl_->set_template(std::move(surface));
}
uint32_t Tracker::format() const { return impl_->format(); }
uint32_t Tracker::memory_stride() const { return impl_->memory_stride(); }
const Rig& Tracker::rig() const { return impl_->rig(); }

}  // namespace defrec
