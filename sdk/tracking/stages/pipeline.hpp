// A frame's way through the stages of a device: images up, surface down. Decides nothing: what a
// frame means is frame_state.hpp's business.
#pragma once
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sdk/base/util/array_part.hpp"
#include "sdk/rig/rig.hpp"
#include "sdk/template/capture.hpp"
#include "sdk/tracking/frame/frame.hpp"
#include "sdk/tracking/frame/tracker_settings.hpp"
#include "sdk/tracking/stages/search_range.hpp"
#include "sdk/tracking/stages/template_stages.hpp"

namespace defrec {

// What a frame's images became, on the host.
struct FrontImages {
    std::vector<uint8_t> gray, mask;  // of the left view
    std::vector<int16_t> disparity;
    float given_sigma_px = 0;   // of disparity that the application gave; 0: stage stereo did
    uint32_t searched_end = 0;  // px, of the disparities that stage stereo searched
    std::vector<defrec_feature> features;  // feature_count of them
    uint32_t feature_count = 0;
};

// One thread. Outlives its frames. A call that fails leaves no work behind that would write into
// the frame it was given.
class Pipeline {
  public:
    Pipeline(std::shared_ptr<const Rig> rig, std::shared_ptr<Device> device,
             const TrackerSettings& settings);
    Pipeline(const Pipeline&) = delete;
    Pipeline& operator=(const Pipeline&) = delete;

    // Rectifies a pair, computes disparity and features, behind the work on the frame before if
    // that is under way. The device may still be at it on return.
    ObservedFrame observe(const FrameTask& task);
    // Whether one more frame can be observed now. A second one only where frames are queued and
    // their stages not timed.
    bool can_observe() const;
    // Takes the right view of frames that are observed from now on to be seen like this. No frame
    // may be on its way.
    void shift_right_view(const Rig::ViewShift& shift);
    void await_gray(const ObservedFrame& frame);
    void await_gray(const RegisteredFrame& frame) { await_gray(frame.frame_); }

    // Queues reading what a template is made of.
    void read_front(const ObservedFrame& frame, FrontImages& images);
    // The same of the left view's gray image alone.
    void read_gray(const ObservedFrame& frame, std::vector<uint8_t>& gray);
    // Throw Error(DEFREC_ERROR_PLUGIN) where the device gave what its stages never give. data: of
    // the template that was followed.
    void check(const FrontImages& images) const;
    void check(const FrameOutput& output, const TemplateData& data) const;
    bool any_wrong_record(const FrameOutput& output, const TemplateData& data,
                          ArrayPart part) const;
    // That as the input of a capture, which shows the images.
    CaptureInput capture_input(const FrontImages& images, uint32_t texture_level) const;
    // A template from the frame's images; empty when too little of them has disparity. again: once
    // more from those that the template was captured from. Else disparities are searched wherever
    // the rig can have them, not where the tissue of a template that there is was.
    std::optional<TemplateData> capture(ObservedFrame& frame, bool again);
    // The share of the image's pixels that has depth when none is ignored, and the share of those
    // that the frame's mask ignores. The frame has a mask, and stays as it is.
    struct IgnoredDepth {
        double depth_share, ignored_share;
    };
    IgnoredDepth look_behind_mask(ObservedFrame& frame);
    // Whether the images match when left and right are exchanged.
    bool views_look_swapped(ObservedFrame& frame);
    // Median difference, px, of the frame's given disparity to what stage stereo measures in its
    // images; none where too few pixels have both.
    std::optional<double> compare_given_disparity(ObservedFrame& frame);
    // Ends a frame whose images turn out to be of no use.
    void forget(ObservedFrame frame);

    // Makes the stages and buffers for this template, and waits for all that was queued before.
    // Keeps what it had if it fails.
    void set_template(const TemplateData& data);
    // Disparities are searched as before there was a template. Nothing is queued.
    void forget_template();
    // Follows the template into the frame, starting from these motions. The device may still be at
    // it on return. Where that fails, the frame stays the caller's, as it was. Throws
    // Error(DEFREC_ERROR_INTERNAL) without a template.
    RegisteredFrame follow(ObservedFrame&& frame, std::span<const defrec_motion> start,
                           const RegistrationPlan& plan = {});
    // Whether follow leaves the host free to look at the images, and can be taken back. Not where
    // the host chooses a part of the map, which later frames keep.
    bool can_follow_speculatively() const;
    // observe and follow by one submission; two where a view in memory is read back.
    RegisteredFrame observe_and_follow(const FrameTask& task, std::span<const defrec_motion> start,
                                       const RegistrationPlan& plan);
    // Waits for what a frame is followed by, and drops it: the frame is as it was before.
    ObservedFrame take_back(RegisteredFrame frame);
    // Whether the last frame was solved in part; whether all that its motions show was.
    bool solved_part() const { return template_->solved_part(); }
    bool solved_all_seen(std::span<const defrec_motion> motions) const {
        return template_->solved_all_seen(motions);
    }
    bool done(const RegisteredFrame& frame, uint64_t timeout_ns) {
        return queue_.wait(frame.end_point_, timeout_ns);
    }
    // For the device's work on a frame.
    std::chrono::nanoseconds deadline() const { return device_->deadline(); }
    // Waits for the end of the frame's work. The frame can be followed once more.
    ObservedFrame finish(RegisteredFrame frame);

    // Writes samples that did not come from follow into the memory where the device would have left
    // them.
    void leave_samples(std::span<const defrec_surface_sample> samples, const DeviceBuffer& memory);

  private:
    friend struct ObservedFrame::End;

    Observation make_observation() const;
    // For the range that is searched now; made where it is missing.
    DeviceStage& stereo();
    void search(const SearchRange& range, bool by_large_windows);
    // Stage stereo, once more.
    void measure_again(ObservedFrame& frame);
    void log_range() const;
    // The range in which the pair's disparities are searched for a template.
    SearchRange find_range(const ObservedFrame& frame);
    // Computes the frame's disparity again where it has to be searched elsewhere.
    void search_for_template(ObservedFrame& frame, uint32_t texture_level, bool again);
    void enqueue_stereo(Observation& o, int first = 0, int second = 1);
    std::unique_ptr<DeviceStage> make_rectify(uint32_t format, uint32_t source_stride) const;
    DeviceStage& rectify_of(const FrameImage& view);
    void upload_maps();
    ObservedFrame take_observation(const FrameTask& task);
    void expect_template() const;
    // Where a frame's images are on the device; nullptr: there are none.
    struct Uploaded {
        const DeviceBuffer *views[2], *ignored;
    };
    Uploaded upload_images(ObservedFrame& frame);
    void rectify(ObservedFrame& frame, const Uploaded& images);
    // The application's, or stage stereo's.
    void find_disparity(ObservedFrame& frame);
    void write_given_disparity(const ObservedFrame& frame, Queue& queue);
    void find_disparity_and_features(ObservedFrame& frame);
    void read_observed(ObservedFrame& frame);
    // Waits for what is queued, after a failure.
    void drain() noexcept;

    std::shared_ptr<const Rig> rig_;
    std::shared_ptr<Device> device_;
    const TrackerSettings settings_;
    const SearchRange plausible_range_;
    SearchRange widest_range_;    // without a template
    SearchRange range_;           // that is searched now
    bool large_windows_ = false;  // for faint texture, by which it is searched

    // Only capturing a template needs them. The queue, which goes before them, may be reading into
    // them.
    FrontImages host_;
    std::vector<uint8_t> looked_gray_[2], looked_mask_[2];  // of a frame that is looked at anew

    Queue queue_;
    std::optional<Queue> uploads_;  // of a second frame, beside the work on the one before
    DeviceBuffer map_[2];
    std::vector<Observation> observations_;  // as many as frames can be observed at a time
    std::unique_ptr<DeviceStage> rectify_, orb_;
    std::unique_ptr<DeviceStage> stereo_;  // null after it could not be made for another range
    std::unique_ptr<DeviceStage> rectify_memory_;  // of images in memory; null before the first
    std::unique_ptr<TemplateStages> template_;
};

}  // namespace defrec
