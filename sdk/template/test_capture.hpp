// What a template is captured from, for the tests of templates.
#pragma once
#include <cstdint>
#include <vector>

#include "sdk/template/capture.hpp"

namespace defrec::test {

// The vectors must outlive the input.
inline CaptureInput capture_input(uint32_t width, uint32_t height, const defrec_camera& camera,
                                  const std::vector<uint8_t>& gray,
                                  const std::vector<uint8_t>& mask,
                                  const std::vector<int16_t>& disparity) {
    CaptureInput input;
    input.width = width;
    input.height = height;
    input.camera = camera;
    input.gray = gray.data();
    input.mask = mask.data();
    input.disparity = disparity.data();
    input.vertex_spacing_px = 8;
    input.node_spacing_px = 20;
    return input;
}

}  // namespace defrec::test
