// The tracker: a queue of frames, a thread that computes them in order, and the results until they
// are released.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "include/defrec_c.h"
#include "sdk/device/context.hpp"
#include "sdk/tracking/frame/frame_input.hpp"

namespace defrec {

class PreparedTargets;
class Rig;
class Services;
class Template;
struct FrameResult;

// One submitted frame. Its memory belongs to the tracker and is used again after release().
class Job {
  public:
    virtual ~Job() = default;

    // DEFREC_OK, DEFREC_TIMEOUT, or the negative status the frame ended with. Any thread.
    virtual defrec_status wait(uint64_t timeout_ns) = 0;
    // Why the frame failed; empty unless wait() gave a negative status.
    virtual std::string error_text() const = 0;
    // Throws Error(DEFREC_ERROR_STATE) unless the frame is done.
    virtual void describe(defrec_result& out) const = 0;
    // The frame's result. Throws Error(DEFREC_ERROR_STATE) unless it is done and has a surface.
    virtual const FrameResult& surface_result() const = 0;
    virtual void lift_points(const double* uv, size_t count, double* xyz, uint8_t* found) const = 0;
    virtual void warp_points(const double* template_xyz, size_t count, double* xyz, uint8_t* status,
                             double* expected_error_mm) const = 0;
    virtual void point_covariances(const double* template_xyz, size_t count, double* covariance,
                                   uint8_t* evidence) const = 0;
    virtual void move_targets(const PreparedTargets& targets, double* xyz, double* covariance,
                              uint8_t* status, double* expected_error_mm) const = 0;
    // Waits if it is running, then gives its place back; the object must not be used afterwards.
    virtual void release() = 0;
    // Lets go of it. False, and own stays: nobody else has it, and what it holds of the device ends
    // with it.
    virtual bool leave(std::shared_ptr<Job>& own) = 0;
    // Services of the context.
    virtual std::shared_ptr<const Services> services() const = 0;
};

class Tracker {
  public:
    // desc as the caller gave it, checked for size and flags; defaults are filled in here. Neither
    // this nor the destructor waits longer than the plugin's deadline for a call of the device.
    Tracker(const Context& context, const std::shared_ptr<const Rig>& rig,
            const defrec_tracker_desc& desc);
    ~Tracker();
    Tracker(const Tracker&) = delete;
    Tracker& operator=(const Tracker&) = delete;

    // Throws Error(DEFREC_ERROR_BUSY) when the queue is full.
    std::shared_ptr<Job> submit(FrameInput input);

    // The caller's memory as a buffer that frames of this tracker may use. Any thread.
    std::shared_ptr<const DeviceBuffer> import_memory(uint32_t kind, void* address,
                                                      uint64_t size) const;
    bool can_use(const DeviceBuffer& memory) const;  // it was imported here

    // Throws Error(DEFREC_ERROR_STATE) before there is one.
    std::shared_ptr<const Template> current_template() const;
    void set_template(std::shared_ptr<const Template> surface);

    uint32_t format() const;         // of the frames
    uint32_t memory_stride() const;  // of left and right images in memory
    const Rig& rig() const;

  private:
    class Impl;
    class Worker;
    DeviceLoan loan_;
    std::unique_ptr<Worker> worker_;
};

}  // namespace defrec
