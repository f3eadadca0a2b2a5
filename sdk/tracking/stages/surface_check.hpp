// The final surface of a frame against its images: whether the left view shows what the template
// has there, and where the right view shows it. Both compare by stage align.
#pragma once
#include <memory>

#include "sdk/template/template.hpp"
#include "sdk/tracking/frame/frame.hpp"

namespace defrec {

// views: the template's images, on the device.
class SurfaceCheck {
  public:
    SurfaceCheck(Queue& queue, const defrec_camera& camera, const TemplateData& data,
                 const DeviceBuffer& views);

    // motions: of the control points, of the final surface.
    void enqueue(Queue& queue, const Observation& observed, const DeviceBuffer& motions,
                 StageTimer& timer);
    void read_back(Queue& queue, FrameOutput& output) const;

  private:
    DeviceBuffer patches_, slopes_, predictions_, observations_;
    std::unique_ptr<DeviceStage> compare_;
};

// For watching the rig.
class RightViewSearch {
  public:
    RightViewSearch(Queue& queue, const defrec_camera& camera, const TemplateData& data,
                    const DeviceBuffer& views);

    void enqueue(Queue& queue, const Observation& observed, const DeviceBuffer& motions,
                 StageTimer& timer);
    void read_back(Queue& queue, FrameOutput& output) const;

  private:
    DeviceBuffer patches_, slopes_, observations_;
    std::unique_ptr<DeviceStage> search_;
};

}  // namespace defrec
