// See template_error.hpp.
#include "sdk/tracking/evidence/template_error.hpp"

#include "sdk/tracking/decisions/confidence.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"

namespace defrec {

std::array<float, 6> stereo_covariance(const defrec_camera& camera, const float position[3],
                                       float sigma_px) {
    const float px2 =
        sigma_px > 0 ? sigma_px * sigma_px : decisions::ExpectedError::kDisparityShare;
    const float z = position[2], x = position[0] / z, y = position[1] / z,
                per_px = depth_per_px(camera, z), depth = px2 * per_px * per_px;
    return {depth * x * x, depth * x * y, depth * x, depth * y * y, depth * y, depth};
}

}  // namespace defrec
