// Points of the surface under pixels of any frame in which it was found.
#pragma once
#include <cstdint>
#include <span>

#include "sdk/template/template.hpp"

namespace defrec {

// vertices: xyz of the surface in the frame, mm, rectified camera. motions: of its control points
// there. uv: pixels of the rectified left image. xyz: where template.motion_at takes to the
// surface's points under them, 0 where there is none; found likewise.
void lift_pixels(const Template& surface, std::span<const float> vertices,
                 std::span<const defrec_motion> motions, std::span<const double> uv,
                 std::span<double> xyz, std::span<uint8_t> found);

}  // namespace defrec
