// What the device's stages give for one frame, and the memory that it is read back into.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sdk/device/device.hpp"
#include "sdk/template/template.hpp"

namespace defrec {

struct FrameSummary {
    uint32_t features = 0;
    defrec_ransac_summary ransac{};
};

// The patches that are searched in the right view as well: every so many, from the first, and as
// densely of tissue that joined.
size_t rig_patch_step(const TemplateData& data);
size_t rig_patch_count(const TemplateData& data);

struct FrameOutput {
    FrameSummary* summary = nullptr;
    std::span<defrec_motion> motions;
    std::span<defrec_surface_sample> samples;              // per vertex
    std::span<defrec_match> matches;                       // per landmark, with preselected weights
    std::span<defrec_patch_observation> observations;      // per patch
    std::span<defrec_patch_prediction> predictions;        // per patch, of the last search
    std::span<defrec_patch_observation> checks;            // per check, on the final surface
    std::span<defrec_patch_prediction> check_predictions;  // per check
    std::span<defrec_patch_observation> right_observations;  // per patch of rig_patches
    std::span<int16_t> disparity;                            // only if kept
    std::array<defrec_stage_time, DEFREC_MAX_TIMED_STAGES> times{};
    uint32_t time_count = 0;

    // Calls take(array, count) for each array that is as long as the template wants it.
    template <class Take>
    void fit(const TemplateData& data, Take&& take) {
        take(motions, data.nodes.size() / 3);
        take(samples, data.vertices.size());
        take(matches, data.landmarks.size());
        take(observations, data.patches.size());
        take(predictions, data.patches.size());
        take(checks, data.checks.size());
        take(check_predictions, data.checks.size());
        take(right_observations, rig_patch_count(data));
    }
};

// Memory of what registering the surface gives. Must outlive the queue that reads into it.
class AttemptMemory {
  public:
    explicit AttemptMemory(std::shared_ptr<const Device> device) : device_(std::move(device)) {}
    // As much as the template wants. Allocates where that is more; no work of a queue may use it.
    void make_room(const TemplateData& data);

  private:
    friend class FrameMemory;
    std::shared_ptr<const Device> device_;
    HostMemory fitted_;
};

// Must outlive the queue that reads into it.
class FrameMemory {
  public:
    // disparities: pixels of the disparity image, 0 if it is not kept.
    FrameMemory(std::shared_ptr<const Device> device, uint64_t disparities);

    // Makes the arrays as large as the template wants them. Allocates where they grow; no work of a
    // queue may use them.
    void fit(const TemplateData& data);

    // What an attempt gave goes out of the way of another one, or comes back.
    void exchange(AttemptMemory& other, const TemplateData& data);

    FrameOutput output;

  private:
    HostMemory fixed_;
    AttemptMemory attempt_;
};

}  // namespace defrec
