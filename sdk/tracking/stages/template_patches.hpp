// Patches of a template, for stage align, which looks for them in a frame.
#pragma once
#include <cstdint>
#include <vector>

#include "sdk/device/device.hpp"
#include "sdk/template/template.hpp"

namespace defrec {

// How the patches move with the control points.
std::vector<defrec_patch_slope> slopes_of(const TemplateData& data,
                                          const std::vector<defrec_patch>& patches);

// For so many patches of a template, in the left view.
defrec_align_params align_params(const defrec_camera& camera, const TemplateData& data,
                                 uint32_t patches);

}  // namespace defrec
