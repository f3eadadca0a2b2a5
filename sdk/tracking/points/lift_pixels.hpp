// Points of the surface under pixels of any frame in which it was found.
#pragma once
#include <cstdint>
#include <span>

#include "sdk/template/template.hpp"

namespace defrec {

// A frame in which the surface was found. vertices: xyz there, mm, rectified camera. motions: of
// the control points. disparity: of the left image, 1/16 px; empty: only what lies on the surface
// is lifted. pieces: of the surface; one that is lost is not there.
struct LiftFrame {
    std::span<const float> vertices;
    std::span<const defrec_motion> motions;
    std::span<const int16_t> disparity;
    std::span<const defrec_piece> pieces;
    bool is_lost(size_t piece) const { return pieces[piece].state == DEFREC_LOST; }
};

// uv: pixels of the rectified left image. xyz: points that point_motion (point_motion.hpp) takes to
// what lies under them, 0 where that is nothing. found: DEFREC_FOUND_*.
void lift_pixels(const Template& surface, const LiftFrame& frame, std::span<const double> uv,
                 std::span<double> xyz, std::span<uint8_t> found);

}  // namespace defrec
