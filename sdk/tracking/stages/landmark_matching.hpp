// The template's landmarks among a frame's features: stages match and ransac.
#pragma once
#include <memory>

#include "sdk/template/template.hpp"
#include "sdk/tracking/frame/frame.hpp"
#include "sdk/tracking/frame/tracker_settings.hpp"

namespace defrec {

// Without landmarks it finds nothing: a surface is then followed by its patches and depth.
class LandmarkMatching {
  public:
    LandmarkMatching(Queue& queue, const defrec_camera& camera, const TrackerSettings& settings,
                     const TemplateData& data);

    void enqueue(Queue& queue, const Observation& observed, StageTimer& timer);
    // With positions in depth, weighted; nullptr without landmarks.
    const DeviceBuffer* matches() const { return match_ != nullptr ? &weighted_ : nullptr; }
    void read_back(Queue& queue, FrameOutput& output) const;

  private:
    DeviceBuffer landmarks_, matches_, weighted_, summary_;
    std::unique_ptr<DeviceStage> match_, ransac_;  // null without landmarks
};

}  // namespace defrec
