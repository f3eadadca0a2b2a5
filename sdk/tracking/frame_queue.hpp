// The frames of a tracker, from submission until the thread that computes takes them: who waits for
// whom, and who copies pixels.
#pragma once
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "sdk/base/os/shared_loop.hpp"
#include "sdk/tracking/frame/tracker_settings.hpp"
#include "sdk/tracking/job.hpp"

namespace defrec {

class Rig;

class FrameQueue {
  public:
    // Has room for settings.frames_in_flight frames, from their submission until their release.
    FrameQueue(const std::shared_ptr<const Device>& device, std::shared_ptr<JobMonitor> monitor,
               const Rig& rig, const TrackerSettings& settings);
    // Leaves the jobs that applications hold to them: Job::leave.
    ~FrameQueue();
    FrameQueue(const FrameQueue&) = delete;
    FrameQueue& operator=(const FrameQueue&) = delete;

    // Copies the images' pixels of the host; returns when the application may use them again. One
    // thread at a time. Throws Error(DEFREC_ERROR_BUSY) when the queue is full,
    // Error(DEFREC_ERROR_DEVICE_LOST) where the device is given up,
    // Error(DEFREC_ERROR_ARGUMENT) for a timestamp that does not grow, or that is implausible.
    std::shared_ptr<TrackerJob> submit(FrameInput input);
    // The frame that is submitted next brings this template along. Any thread.
    void set_template(std::shared_ptr<const Template> surface);
    // That template, until it is followed or another one captured in its place; else null. Any
    // thread.
    std::shared_ptr<const Template> template_to_set() const;
    // It is. For the thread that computes.
    void end_template(const Template& surface);

    // For the thread that computes. Waits for the frame after the last one taken; nullptr: the
    // queue was stopped, and is empty.
    TrackerJob* take();
    // That frame if it is there already, to look ahead.
    struct Next {
        TrackerJob* job = nullptr;
        bool may_come = false;  // where there is none yet
    };
    Next next() const;

    // No frame is submitted any more; those in the queue are taken to be cancelled. Any thread.
    void stop();
    bool is_stopped() const { return stopped_ || monitor_->is_given_up; }

  private:
    struct Reserved {
        std::shared_ptr<TrackerJob> job;
        bool is_idle;  // no other frame is under way
    };
    Reserved reserve(int64_t timestamp_ns);
    void check_timestamp(int64_t timestamp_ns);
    std::unique_lock<std::mutex> await_frame();

    const Rig& rig_;
    const uint32_t height_, width_, format_;
    const Services* helpers_;  // whose threads copy pixels as well; may be null
    const std::shared_ptr<JobMonitor> monitor_;
    std::vector<std::shared_ptr<TrackerJob>> jobs_;
    SharedLoop copying_;               // of the pixels of the frame that is being submitted
    std::condition_variable arrived_;  // with the monitor's mutex, for the thread that computes
    // Written under the monitor's mutex.
    std::atomic<uint64_t> submitted_ = 0,
                          announced_ = 0;  // frames; announced before their pixels are copied
    std::atomic<bool> stopped_ = false;
    // Under the monitor's mutex.
    std::vector<TrackerJob*> order_;  // a ring: frame n at n % size
    int64_t last_timestamp_ = 0;
    std::optional<int64_t> refused_timestamp_;  // as too far after the last
    std::shared_ptr<const Template> template_to_set_;
    bool is_template_new_ = false;  // no frame has brought it along

    uint64_t taken_ = 0;  // the computing thread's own: frames
};

}  // namespace defrec
