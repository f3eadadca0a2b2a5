// One place in a tracker's queue: the frame's pixels, then its results, until it is released and
// used again.
#pragma once
#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "sdk/device/context.hpp"
#include "sdk/tracking/frame/frame_output.hpp"
#include "sdk/tracking/frame_result.hpp"
#include "sdk/tracking/points/prepared_set.hpp"
#include "sdk/tracking/tracker.hpp"

namespace defrec {

// What all jobs of a tracker share; outlives the tracker while a job is held.
struct JobMonitor {
    JobMonitor(DeviceChoice choice, std::shared_ptr<const DeviceWatch> device_watch)
        : device(std::move(choice)), watch(std::move(device_watch)) {}

    // Ends all jobs: the thread that computes is stuck in a call of the device.
    void give_up(const char* call);

    const DeviceChoice device;
    const std::shared_ptr<const DeviceWatch> watch;
    std::mutex mutex;                      // guards the phases
    std::atomic<bool> is_given_up{false};  // written under the mutex
    std::string failure;                   // under the mutex: why it is given up
    PreparedSets prepared;                 // of points that applications move frame by frame
};

enum class JobPhase { kFree, kQueued, kRunning, kEnding, kDone };

class TrackerJob final : public Job {
  public:
    // pixels: of a view. grows: the template may, so that points beside it are followed as well.
    // Must outlive the tracker's queue.
    TrackerJob(std::shared_ptr<JobMonitor> monitor, const std::shared_ptr<const Device>& device,
               uint64_t pixels, bool keep_disparity, bool grows);

    defrec_status wait(uint64_t timeout_ns) override;
    std::string error_text() const override;
    void describe(defrec_result& out) const override;
    const FrameResult& surface_result() const override;
    void lift_points(const double* uv, size_t count, double* xyz, uint8_t* found) const override;
    void warp_points(const double* template_xyz, size_t count, double* xyz, uint8_t* status,
                     double* expected_error_mm) const override;
    void point_covariances(const double* template_xyz, size_t count, double* covariance,
                           uint8_t* evidence) const override;
    void move_targets(const PreparedTargets& targets, double* xyz, double* covariance,
                      uint8_t* status, double* expected_error_mm) const override;
    void release() override;
    bool leave(std::shared_ptr<Job>& own) override;
    std::shared_ptr<const Services> services() const override { return monitor->device.services(); }

    // The members below belong to the tracker while the phase is queued or running.
    std::shared_ptr<JobMonitor> monitor;
    std::atomic<JobPhase> phase = JobPhase::kFree;  // written under the monitor's mutex
    defrec_status status = DEFREC_OK;  // under the monitor's mutex; of one that is done

    // For the copies of this frame, where there is none yet.
    void make_room(const FrameInput& coming);
    // For what the stages give with this template: a job that was last used with another one has
    // arrays of another size. Throws Error(DEFREC_ERROR_ARGUMENT) where the frame's own memory for
    // samples is too small.
    void make_room(const TemplateData& data);

    HostMemory views[2], ignore;  // gray copies of host pixels, tight rows; of a view in memory,
                                  // its rectified pixels
    // Disparity of the application and its errors; empty before the first.
    ContextVector<int16_t> disparity;
    ContextVector<float> sigma;
    // Views' where the device is the processor, else empty.
    DeviceBuffer views_in_device[2];
    ColourCells colours;  // of the left view's host pixels
    FrameInput input;     // its host pixels are these copies
    uint64_t frame = 0;
    std::shared_ptr<const Template> template_to_set;

    FrameMemory memory;  // of what the stages give
    FrameResult result;  // of a frame that is done

    // The rest takes little longer than to wake up, which who waits may do in the meantime.
    void announce_end();
    // Ends the job. text says why it failed; empty for success.
    void finish(defrec_status result_status, const char* text) noexcept;

  private:
    // Under the monitor's mutex.
    bool has_ended() const { return phase == JobPhase::kDone || monitor->is_given_up; }
    // lock: of the monitor's mutex.
    void give_up(std::unique_lock<std::mutex>& lock);
    void expect_done() const;
    void expect_surface() const;
    using Carried = std::function<void(size_t, const CarriedPoint&)>;
    // Calls carried for each of the points of the template frame.
    void carry(const double* template_xyz, size_t count, const Carried& carried) const;
    CarryingSurface carrying_surface() const;

    const std::shared_ptr<const Device> device_;
    const uint64_t pixels_;
    const bool grows_;
    // With the monitor's mutex. Nobody is told when the device is given up: who waits looks.
    std::condition_variable changed_;
    std::string error_text_;
    PointCarrier carrier_;
};

}  // namespace defrec
