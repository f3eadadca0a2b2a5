// How far off the vertices of a template may be: what stereo left of their depth.
#pragma once
#include <array>

#include "sdk/template/template.hpp"

namespace defrec {

// Covariance of the error of a place whose depth was measured by stereo, mm^2: xx, xy, xz, yy, yz,
// zz. position: rectified camera, mm, in front of it. sigma_px: of the disparity where an
// application gave it, 0: stage stereo did. The error lies along the line of sight.
std::array<float, 6> stereo_covariance(const defrec_camera& camera, const float position[3],
                                       float sigma_px);

}  // namespace defrec
