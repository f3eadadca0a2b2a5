// Where a point of the rectified camera falls in the image, and how deep the live surface lies
// there by the disparity image. The rule that lm and warp share (docs/stages/warp.md).
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "backends/shared/live_depth_constants.h"
#include "backends/shared/motion.hpp"

namespace defrec {

template <class T>
struct Pixel {
    T u, v;
};

// width and height at least 2; stride in elements. data nullptr: no depth anywhere.
struct DisparityImage {
    const int16_t* data;
    uint32_t width, height, stride;
};

// True, and the pixel, if p lies in front of the camera and inside the image, borders included.
template <class T>
constexpr bool project_inside(const defrec_camera& camera, const DisparityImage& image, Vec3<T> p,
                              Pixel<T>& pixel) {
    if (!(p.z > T(kMinDepthMm))) return false;
    const T inverse_z = T(1) / p.z;
    pixel = {T(camera.fx) * (p.x * inverse_z) + T(camera.cx),
             T(camera.fy) * (p.y * inverse_z) + T(camera.cy)};
    return pixel.u >= T(0) && pixel.v >= T(0) && pixel.u <= T(image.width - 1) &&
           pixel.v <= T(image.height - 1);
}

// Depth, mm, at a pixel inside the image; 0 where there is none. Between four valid disparities
// that lie close together it is bilinear in disparity, else it is that of the nearest pixel.
template <class T>
constexpr T live_depth(const defrec_camera& camera, const DisparityImage& image, Pixel<T> pixel) {
    if (image.data == nullptr) return T(0);
    const int32_t x = std::min(int32_t(pixel.u), int32_t(image.width) - 2),
                  y = std::min(int32_t(pixel.v), int32_t(image.height) - 2);
    const T right = pixel.u - T(x), below = pixel.v - T(y);
    const int16_t* row = image.data + size_t(y) * image.stride + size_t(x);
    const int32_t d00 = row[0], d01 = row[1], d10 = row[image.stride], d11 = row[image.stride + 1];
    const int32_t minimum = std::min(std::min(d00, d01), std::min(d10, d11));
    const int32_t maximum = std::max(std::max(d00, d01), std::max(d10, d11));
    T disparity;
    if (minimum > 0 && maximum - minimum <= kLargestDepthStep) {
        const T above = T(d00) + right * T(d01 - d00), under = T(d10) + right * T(d11 - d10);
        disparity = above + below * (under - above);
    } else {
        const bool to_right = right >= T(0.5), to_below = below >= T(0.5);
        disparity = T(to_below ? (to_right ? d11 : d10) : (to_right ? d01 : d00));
    }
    if (!(disparity > T(0))) return T(0);
    const T whole = disparity + T(kDisparityOne * camera.disparity_offset_px);
    if (!(whole > T(0))) return T(0);
    return T(double(kDisparityOne) * camera.fx * camera.baseline_mm) / whole;
}

}  // namespace defrec
