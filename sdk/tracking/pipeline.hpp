// One frame's way through the stages of a device: images up, surface down. Holds every buffer and
// stage that a tracker needs; decides nothing: what a frame means is frame_state.hpp's business.
#pragma once
#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sdk/device/context.hpp"
#include "sdk/device/device.hpp"
#include "sdk/rig/rig.hpp"
#include "sdk/template/capture.hpp"
#include "sdk/template/template.hpp"
#include "sdk/tracking/frame_input.hpp"
#include "sdk/tracking/frame_output.hpp"

namespace defrec {

// A tracker's description with every default filled in.
using TrackerSettings = defrec_tracker_desc;
// Throws Error(DEFREC_ERROR_ARGUMENT) for values that are out of range.
TrackerSettings complete_settings(const defrec_tracker_desc& desc, const Rig& rig);

class Pipeline {
  public:
    Pipeline(std::shared_ptr<Context> context, std::shared_ptr<const Rig> rig,
             std::shared_ptr<Device> device, const TrackerSettings& settings);
    ~Pipeline();

    // Rectifies a pair (host pixels in tight rows), computes disparity and features. The device may
    // still be at it: images must stay as they are, and out is complete, when capture, finish or
    // forget_observation has returned. gray: where the rectified pixels of an view in memory are
    // read back to.
    void observe(const FrameInput& frame, std::array<uint8_t*, 2> gray, FrameOutput& out);
    // The same for the frame after the one that is followed, behind that one's work; only where
    // can_observe_ahead. The calls below go on to mean the frame that is followed until use_ahead.
    void observe_ahead(const FrameInput& frame, std::array<uint8_t*, 2> gray, FrameOutput& out);
    bool can_observe_ahead() const { return uploads_.has_value(); }
    void use_ahead() { std::swap(now_, ahead_); }
    // Waits for gray.
    void await_gray();

    // Instead of capture and follow, where the images turn out to be of no use.
    void forget_observation(FrameOutput& out);

    // A template from the images last observed; empty when too little of them has disparity.
    std::optional<TemplateData> capture();
    // Whether the images last observed match when left and right are exchanged.
    bool views_look_swapped();

    // Makes the stages and buffers for this template, and waits for all that was queued before.
    // Allocates; keeps what it had if it fails.
    void set_template(std::shared_ptr<const Template> surface);

    // Follows the template into the images last observed, starting from these motions. samples:
    // where the device leaves them; may be null. The device may still be at it.
    void follow(std::span<const defrec_motion> start, const DeviceBuffer* samples,
                FrameOutput& out);
    // Waits for what observe and follow began; done tells whether it is over.
    void finish(FrameOutput& out);
    bool done(uint64_t timeout_ns) { return queue_.wait(followed_, timeout_ns); }

    // Writes samples that did not come from follow into the memory where the device would have left
    // them.
    void leave_samples(std::span<const defrec_surface_sample> samples, const DeviceBuffer& memory);

    // Waits for what is queued, after a failure: nothing may be written into a frame's output
    // later.
    void drain() noexcept;

  private:
    struct TemplateStages;
    // What one frame's images become on the device.
    struct Observation {
        DeviceBuffer raw[2], gray[2], mask[2], ignore, disparity, feature_count, features;
        uint64_t gray_point = 0;  // in the queue, behind what await_gray waits for; 0: nothing
    };

    Observation make_observation() const;
    void see(Observation& o, Queue& uploads, const FrameInput& frame, std::array<uint8_t*, 2> gray,
             FrameOutput& out);
    std::unique_ptr<DeviceStage> make_stereo(uint32_t min_disparity, uint32_t disparities) const;
    std::unique_ptr<DeviceStage> make_rectify(uint32_t source_stride) const;
    void upload_maps();
    void upload_template(TemplateStages& stages, const TemplateData& data);
    void record_time(const char* stage, FrameOutput& out);
    uint32_t widest_search() const;
    void narrow_search(const SurfaceGrid& grid);
    void download_front();

    std::shared_ptr<Context> context_;
    std::shared_ptr<const Rig> rig_;
    std::shared_ptr<Device> device_;
    TrackerSettings settings_;
    uint32_t width_, height_;

    // Host copies that only capturing a template needs. The queue, which goes before them, may be
    // reading into them.
    std::vector<uint8_t> host_gray_, host_mask_;
    std::vector<int16_t> host_disparity_;
    std::vector<defrec_feature> host_features_;
    uint32_t host_feature_count_ = 0;

    Queue queue_;
    std::optional<Queue>
        uploads_;  // of frames that are observed ahead, beside the work on the one before
    DeviceBuffer map_[2];
    Observation observations_[2];  // the second only where frames are observed ahead
    Observation *now_ = &observations_[0], *ahead_ = &observations_[1];
    std::unique_ptr<DeviceStage> rectify_, rectify_memory_, stereo_,
        orb_;  // rectify_memory_: where memory has another stride
    uint32_t feature_capacity_ = 0;
    uint64_t followed_ = 0;  // in the queue, behind what follow began
    std::unique_ptr<TemplateStages> follow_;
    std::chrono::steady_clock::time_point last_time_;
};

}  // namespace defrec
