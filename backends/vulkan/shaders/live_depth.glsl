// Where a point of the rectified camera falls in the image, and how deep the live surface lies
// there: backends/shared/live_depth.hpp in single precision. Who includes it defines
// LIVE_DISPARITY(i) before: the disparity at index i, an int.
#include "backends/stages/surface.hpp"

// True, and the pixel, if p lies in front of the camera and inside the image, borders included.
bool project_inside(FloatCamera camera, DisparityGrid image, vec3 p, out vec2 pixel) {
    pixel = vec2(0);
    if (!(p.z > kMinDepthMm)) return false;
    pixel = vec2(camera.fx, camera.fy) * (p.xy * (1.0 / p.z)) + vec2(camera.cx, camera.cy);
    return pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x <= float(image.width - 1) &&
           pixel.y <= float(image.height - 1);
}

// Depth, mm, at a pixel inside the image; 0 where there is none.
float live_depth(FloatCamera camera, DisparityGrid image, vec2 pixel) {
    if (image.stride == 0) return 0.0;
    const ivec2 corner = min(ivec2(pixel), ivec2(image.width, image.height) - 2);
    const vec2 beyond = pixel - vec2(corner);
    const int at = corner.y * image.stride + corner.x;
    const int d00 = LIVE_DISPARITY(at), d01 = LIVE_DISPARITY(at + 1);
    const int d10 = LIVE_DISPARITY(at + image.stride), d11 = LIVE_DISPARITY(at + image.stride + 1);
    const int minimum = min(min(d00, d01), min(d10, d11)),
              maximum = max(max(d00, d01), max(d10, d11));
    float disparity;
    if (minimum > 0 && maximum - minimum <= kLargestDepthStep) {
        const float above = float(d00) + beyond.x * float(d01 - d00),
                    under = float(d10) + beyond.x * float(d11 - d10);
        disparity = above + beyond.y * (under - above);
    } else {
        const bool to_right = beyond.x >= 0.5, to_below = beyond.y >= 0.5;
        disparity = float(to_below ? (to_right ? d11 : d10) : (to_right ? d01 : d00));
    }
    if (!(disparity > 0.0)) return 0.0;
    const float whole = disparity + camera.disparity_offset;
    return whole > 0.0 ? float(kDisparityOne) * camera.fx * camera.baseline_mm / whole : 0.0;
}
