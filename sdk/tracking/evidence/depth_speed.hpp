// How fast the disparities of a surface change, which tells what they do while none is measured.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

class DepthSpeed {
  public:
    // The surface of a template with so many vertices is at rest.
    void begin(size_t vertices);
    // The same surface with more of them, which are at rest.
    void grow(size_t vertices) { speed_.resize(vertices); }
    // The next frame does not follow from the last one.
    void interrupt();
    // The samples of a frame that was followed and of the one before. is_measured: by disparities,
    // among others.
    void add_frame(const defrec_camera& camera, std::span<const defrec_surface_sample> before,
                   std::span<const defrec_surface_sample> now, bool is_measured);
    // px^2 that a vertex's disparity may have changed in the next frame, if it is not measured
    // there either, since it was measured last.
    float unmeasured_px2(size_t vertex) const {
        return squared_frames_ * (speed_[vertex] * speed_[vertex] + usual_ * usual_);
    }

  private:
    std::vector<float> speed_;  // px a frame
    float usual_ = 0;           // px a frame, root of the mean square over the vertices
    int unmeasured_ = 0;        // frames since disparities were measured
    float squared_frames_ = 0;  // that, and the next frame
    bool is_interrupted_ = true;
};

}  // namespace defrec
