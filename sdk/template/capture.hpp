// Makes a template from one frame's images and disparity.
#pragma once
#include <optional>
#include <span>

#include "sdk/template/template.hpp"

namespace defrec {

struct CaptureInput {
    uint32_t width = 0, height = 0;
    defrec_camera camera{};
    const uint8_t* gray = nullptr;       // rectified left image, width * height
    const uint8_t* mask = nullptr;       // 255 usable
    const int16_t* disparity = nullptr;  // 1/16 px
    float disparity_sigma_px = 0;        // as TemplateData has it
    std::span<const defrec_feature> features;
    double vertex_spacing_px = 8;
    double node_spacing_px = 40;
    uint32_t max_patches = 1024;
    uint32_t texture_level = 0;  // as TemplateData has it
};

// The largest connected surface, smoothed, holes filled and its rim continued a little beyond the
// measured disparities (vertex_support tells how far). Empty when too little of the image has
// disparity.
std::optional<TemplateData> capture_template(const CaptureInput& input);

}  // namespace defrec
