// By how much live depth contradicted the surface in the frames before, where its check was found:
// stereo that agrees with it in single frames, as beside a crease, does so by chance.
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
    // The samples of a frame that was followed by disparities. is_confirmed: per vertex, by its
    // check.
    void add_frame(std::span<const defrec_surface_sample> samples,
                   std::span<const uint8_t> is_confirmed);
    // Per vertex, how far depth may still be off. As many as the surface had in the last frame.
    std::span<const float> mm() const { return mm_; }

  private:
    std::vector<float> mm_;
};

}  // namespace defrec
