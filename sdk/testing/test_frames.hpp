// Small valid descriptions, parameters and frames for tests of the C API.
#pragma once
#include <cstdint>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::test {

// Rectified cameras, 64 x 48.
inline defrec_rig_desc small_rig() {
    defrec_rig_desc desc;
    DEFREC_INIT(&desc);
    desc.width = 64;
    desc.height = 48;
    desc.left.fx = desc.left.fy = 70;
    desc.left.cx = 32;
    desc.left.cy = 24;
    desc.right = desc.left;
    desc.rotation[0] = desc.rotation[4] = desc.rotation[8] = 1;
    desc.translation[0] = -4.6;
    return desc;
}

inline defrec_ransac_params small_ransac() {
    defrec_ransac_params params;
    DEFREC_INIT(&params);
    params.landmarks = 10;
    return params;
}

inline defrec_warp_params small_warp() {
    defrec_warp_params params;
    DEFREC_INIT(&params);
    params.nodes = params.points = 4;
    params.width = 64;
    params.height = 48;
    params.camera = {70, 70, 32, 24, 4.6, 0};
    return params;
}

// Two gray images, 64 x 48.
struct SmallFrame {
    SmallFrame() : pixels(64 * 48) {
        for (size_t i = 0; i < pixels.size(); ++i)
            pixels[i] = static_cast<uint8_t>(i * 7 + i / 64 * 13);
        DEFREC_INIT(&image);
        image.format = DEFREC_FORMAT_GRAY8;
        image.width = 64;
        image.height = 48;
        image.pixels = pixels.data();
        DEFREC_INIT(&frame);
        frame.timestamp_ns = 1;
        frame.left = frame.right = &image;
    }
    SmallFrame(const SmallFrame&) = delete;
    SmallFrame& operator=(const SmallFrame&) = delete;

    std::vector<uint8_t> pixels;
    defrec_image image;
    defrec_frame frame;
};

}  // namespace defrec::test
