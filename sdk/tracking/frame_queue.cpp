// See frame_queue.hpp.
#include "sdk/tracking/frame_queue.hpp"

#include <chrono>

#include "sdk/base/services.hpp"
#include "sdk/base/spin.hpp"
#include "sdk/contract/pixel_format.hpp"
#include "sdk/rig/rig.hpp"

namespace defrec {

// A device that computes on the processor has better use for the pool than copying.
FrameQueue::FrameQueue(const std::shared_ptr<const Device>& device, const Rig& rig,
                       const TrackerSettings& settings)
    : height_(rig.height()),
      row_bytes_(uint64_t{rig.width()} * bytes_per_pixel(settings.format)),
      ignore_row_bytes_(rig.width()),
      helpers_(device->has_host_memory() ? &device->services() : nullptr) {
    const uint64_t pixels = uint64_t{rig.width()} * height_;
    for (uint32_t i = 0; i < settings.frames_in_flight; ++i)
        jobs_.push_back(std::make_shared<TrackerJob>(monitor_, device, row_bytes_ * height_, pixels,
                                                     settings.keep_disparity, settings.grow != 0));
    order_.resize(settings.frames_in_flight);
}

std::shared_ptr<TrackerJob> FrameQueue::submit(FrameInput input) {
    std::shared_ptr<TrackerJob> job = reserve(input.timestamp_ns);
    const KeptImage images[] = {{input.views[0], row_bytes_, job->views[0].as<uint8_t>()},
                                {input.views[1], row_bytes_, job->views[1].as<uint8_t>()},
                                {input.ignore, ignore_row_bytes_, job->ignore.as<uint8_t>()}};
    keep_pixels(images, height_, copying_, helpers_);
    job->input = std::move(input);

    const std::lock_guard lock(monitor_->mutex);
    last_timestamp_ = job->input.timestamp_ns;
    job->frame = submitted_;
    job->template_to_set = std::exchange(template_to_set_, nullptr);
    job->phase = JobPhase::kQueued;
    order_[submitted_ % order_.size()] = job.get();
    ++submitted_;
    arrived_.notify_all();
    return job;
}

std::shared_ptr<TrackerJob> FrameQueue::reserve(int64_t timestamp_ns) {
    const std::lock_guard lock(monitor_->mutex);
    if (submitted_ > 0 && timestamp_ns <= last_timestamp_)
        fail(DEFREC_ERROR_ARGUMENT, "timestamp_ns is ", timestamp_ns, ", the frame before had ",
             last_timestamp_, "; it must grow");
    for (const std::shared_ptr<TrackerJob>& job : jobs_)
        if (job->phase == JobPhase::kFree) {
            announced_ = submitted_ + 1;
            arrived_.notify_all();
            return job;
        }
    fail(DEFREC_ERROR_BUSY, "all ", jobs_.size(),
         " places in the queue are taken; release a job first");
}

void FrameQueue::set_template(std::shared_ptr<const Template> surface) {
    const std::lock_guard lock(monitor_->mutex);
    template_to_set_ = std::move(surface);
}

std::shared_ptr<const Template> FrameQueue::template_to_set() const {
    const std::lock_guard lock(monitor_->mutex);
    return template_to_set_;
}

// Sleeps until a frame is announced, and wakes up while its pixels are copied, where it helps.
std::unique_lock<std::mutex> FrameQueue::await_frame() {
    constexpr std::chrono::nanoseconds kSpin = std::chrono::microseconds(50),
                                       kCopying = std::chrono::milliseconds(1);
    const auto announced = [this] { return stopped_ || announced_ > taken_; };
    const auto arrived = [this] { return stopped_ || submitted_ > taken_; };
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
    if (stopped_) return {};
    if (submitted_ <= taken_) return {nullptr, true};
    return {order_[taken_ % order_.size()], true};
}

void FrameQueue::stop() {
    const std::lock_guard lock(monitor_->mutex);
    stopped_ = true;
    arrived_.notify_all();
}

}  // namespace defrec
