// What a template is captured from, for the tests of templates.
#pragma once
#include <cmath>
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

// A plane that faces the camera so many mm away, with texture all over.
struct PlaneImages {
    std::vector<uint8_t> gray, mask;
    std::vector<int16_t> disparity;

    PlaneImages(uint32_t width, uint32_t height, const defrec_camera& camera, double depth)
        : mask(width * height, 255),
          disparity(width * height, static_cast<int16_t>(
                                        std::lround(16 * camera.fx * camera.baseline_mm / depth))) {
        for (uint32_t y = 0; y < height; ++y)
            for (uint32_t x = 0; x < width; ++x)
                gray.push_back(static_cast<uint8_t>(128 + 40 * std::sin(0.45 * x + 0.07 * y) *
                                                              std::cos(0.4 * y)));
    }
};

}  // namespace defrec::test
