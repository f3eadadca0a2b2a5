// What a device gave is checked before it is believed: a plugin may be wrong, or its memory
// damaged. Every value of gray images, masks and kept disparity means something.
#pragma once
#include <cstdint>
#include <span>

#include "sdk/base/util/array_part.hpp"
#include "sdk/tracking/frame/frame_output.hpp"

namespace defrec {

struct FrontImages;  // pipeline.hpp

// Whether any value in that part of each array is one that its stage never gives, but for those of
// samples.
bool any_wrong_record(const FrameOutput& output, const TemplateData& data, uint32_t max_features,
                      ArrayPart part);
bool any_wrong_sample(std::span<const defrec_surface_sample> samples);
// Throw Error(DEFREC_ERROR_PLUGIN) that names stage, buffer and index of such a value, if there is
// one.
void check_output(const FrameOutput& output, const TemplateData& data, uint32_t max_features);
void check_front(const FrontImages& images, uint32_t width, uint32_t height, uint32_t max_features);

}  // namespace defrec
