// Remembers where live depth contradicted the surface although its check was found. Stereo agrees
// with such a place by chance, as beside a crease, in the frames between.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

class ContradictedDepth {
  public:
    // A template with so many vertices, which nothing contradicted.
    void begin(size_t vertices) { mm_.assign(vertices, 0); }
    // The same surface with more of them.
    void grow(size_t vertices) { mm_.resize(vertices); }
    // A frame that was followed by disparities. Per vertex: its sample; whether its check was
    // found, without which the frame tells nothing of it; and its status: one that is unknown may
    // be anywhere.
    void add_frame(std::span<const defrec_surface_sample> samples,
                   std::span<const uint8_t> is_confirmed, std::span<const uint8_t> status);
    // Per vertex, how far depth is off by the frames before.
    std::span<const float> doubt_mm() const { return mm_; }

  private:
    std::vector<float> mm_;
};

}  // namespace defrec
