// See frame_queue.hpp.
#include "sdk/tracking/frame_queue.hpp"

#include <chrono>

#include "sdk/base/os/services.hpp"
#include "sdk/base/os/spin.hpp"
#include "sdk/rig/rig.hpp"

namespace defrec {

// A device that computes on the processor has better use for the pool than copying.
FrameQueue::FrameQueue(const std::shared_ptr<const Device>& device,
                       std::shared_ptr<JobMonitor> monitor, const Rig& rig,
                       const TrackerSettings& settings)
    : rig_(rig),
      height_(rig.height()),
      width_(rig.width()),
      format_(settings.format),
      helpers_(device->has_host_memory() ? &device->services() : nullptr),
      monitor_(std::move(monitor)) {
    const uint64_t pixels = uint64_t{rig.width()} * height_;
    for (uint32_t i = 0; i < settings.frames_in_flight; ++i)
        jobs_.push_back(std::make_shared<TrackerJob>(monitor_, device, pixels,
                                                     settings.keep_disparity, settings.grow != 0));
    order_.resize(settings.frames_in_flight);
}

FrameQueue::~FrameQueue() {
    const std::lock_guard lock(monitor_->mutex);
    for (std::shared_ptr<TrackerJob>& job : jobs_)
        if (job.use_count() > 1) job.reset();
}

std::shared_ptr<TrackerJob> FrameQueue::submit(FrameInput input) {
    const Reserved reserved = reserve(input.timestamp_ns);
    const std::shared_ptr<TrackerJob>& job = reserved.job;
    job->make_room(input);
    const auto view = [&](size_t i) -> KeptImage {
        const DeviceBuffer& in_device = job->views_in_device[i];
        return {input.views[i],
                format_,
                width_,
                job->views[i].as<uint8_t>(),
                in_device ? &in_device : nullptr,
                input.field,
                i == 0 ? &job->colours : nullptr};
    };
    const bool has_pixels = input.views[0].pixels != nullptr;
    job->colours.begin(format_, has_pixels ? width_ : 0, has_pixels ? height_ : 0);
    const KeptImage images[] = {
        view(0), view(1), {input.ignore, DEFREC_FORMAT_GRAY8, width_, job->ignore.as<uint8_t>()}};
    if (input.given_disparity.values != nullptr)
        input.disparity =
            keep_disparity(input.given_disparity, rig_, input.ignore, job->disparity, job->sigma);
    input.given_disparity = {};
    keep_pixels(images, height_, copying_, helpers_, reserved.is_idle);
    job->input = std::move(input);

    const std::lock_guard lock(monitor_->mutex);
    last_timestamp_ = job->input.timestamp_ns;
    job->frame = submitted_;
    job->template_to_set = std::exchange(is_template_new_, false) ? template_to_set_ : nullptr;
    job->phase = JobPhase::kQueued;
    order_[submitted_ % order_.size()] = job.get();
    ++submitted_;
    arrived_.notify_all();
    return job;
}

FrameQueue::Reserved FrameQueue::reserve(int64_t timestamp_ns) {
    const std::lock_guard lock(monitor_->mutex);
    if (monitor_->is_given_up) fail(DEFREC_ERROR_DEVICE_LOST, monitor_->failure);
    check_timestamp(timestamp_ns);
    for (const std::shared_ptr<TrackerJob>& job : jobs_)
        if (job->phase == JobPhase::kFree) {
            announced_ = submitted_ + 1;
            arrived_.notify_all();
            const bool is_idle = std::all_of(
                jobs_.begin(), jobs_.end(), [](const std::shared_ptr<TrackerJob>& other) {
                    return other->phase == JobPhase::kFree || other->phase == JobPhase::kDone;
                });
            return {job, is_idle};
        }
    fail(DEFREC_ERROR_BUSY, "all ", jobs_.size(),
         " places in the queue are taken; release a job first");
}

// One wrong timestamp must not make all later ones too small, so a jump of more than a day is
// refused. A clock that was set does not return: the second frame after such a jump is accepted. A
// shorter jump is believed, and never taken back: what frames are compared by would run backwards.
void FrameQueue::check_timestamp(int64_t timestamp_ns) {
    constexpr uint64_t kMaxGap = uint64_t{24} * 3600 * 1000000000u;
    const auto gap = [&](int64_t before) {
        return static_cast<uint64_t>(timestamp_ns) - static_cast<uint64_t>(before);
    };
    if (timestamp_ns > INT64_MAX - static_cast<int64_t>(kMaxGap))
        fail(DEFREC_ERROR_ARGUMENT, "timestamp_ns is ", timestamp_ns,
             ", less than a day before the end of all timestamps");
    if (submitted_ == 0) return;
    if (timestamp_ns <= last_timestamp_)
        fail(DEFREC_ERROR_ARGUMENT, "timestamp_ns is ", timestamp_ns, ", the frame before had ",
             last_timestamp_,
             "; it must grow. If that one was wrong, or the clock was set back, go "
             "on with another tracker and the template of this one");
    if (gap(last_timestamp_) <= kMaxGap) {
        refused_timestamp_.reset();
        return;
    }
    const bool is_confirmed = refused_timestamp_ && timestamp_ns > *refused_timestamp_ &&
                              gap(*refused_timestamp_) <= kMaxGap;
    if (is_confirmed) return;
    refused_timestamp_ = timestamp_ns;
    fail(DEFREC_ERROR_ARGUMENT, "timestamp_ns is ", timestamp_ns, ", more than a day after ",
         last_timestamp_, " of the frame before; if the clock was set, the next frame is accepted");
}

void FrameQueue::set_template(std::shared_ptr<const Template> surface) {
    const std::lock_guard lock(monitor_->mutex);
    template_to_set_ = std::move(surface);
    is_template_new_ = true;
}

void FrameQueue::end_template(const Template& surface) {
    const std::lock_guard lock(monitor_->mutex);
    if (template_to_set_.get() == &surface && !is_template_new_) template_to_set_ = nullptr;
}

std::shared_ptr<const Template> FrameQueue::template_to_set() const {
    const std::lock_guard lock(monitor_->mutex);
    return template_to_set_;
}

// Sleeps until a frame is announced, and wakes up while its pixels are copied, where it helps.
std::unique_lock<std::mutex> FrameQueue::await_frame() {
    constexpr std::chrono::nanoseconds kSpin = std::chrono::microseconds(50),
                                       kCopying = std::chrono::milliseconds(1);
    const auto announced = [this] { return is_stopped() || announced_ > taken_; };
    const auto arrived = [this] { return is_stopped() || submitted_ > taken_; };
    spin_until(kSpin, announced);
    std::unique_lock lock(monitor_->mutex);
    arrived_.wait(lock, announced);
    if (!arrived()) {
        lock.unlock();
        spin_until(kCopying, [&] {
            copying_.help();
            return arrived();
        });
        lock.lock();
        arrived_.wait(lock, arrived);
    }
    return lock;
}

TrackerJob* FrameQueue::take() {
    const std::unique_lock lock = await_frame();
    if (submitted_ <= taken_) return nullptr;
    TrackerJob* job = order_[taken_++ % order_.size()];
    job->phase = JobPhase::kRunning;
    return job;
}

FrameQueue::Next FrameQueue::next() const {
    const std::lock_guard lock(monitor_->mutex);
    if (is_stopped()) return {};
    if (submitted_ <= taken_) return {nullptr, true};
    return {order_[taken_ % order_.size()], true};
}

void FrameQueue::stop() {
    const std::lock_guard lock(monitor_->mutex);
    stopped_ = true;
    arrived_.notify_all();
}

}  // namespace defrec
