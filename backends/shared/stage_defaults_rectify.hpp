// Defaults of the parameters of stage rectify, for whoever creates the stage.
#pragma once
#include "include/defrec_c.h"

namespace defrec {

// Bytes per pixel of a DEFREC_FORMAT_*; 0 for anything else.
constexpr uint32_t bytes_per_pixel(uint32_t format) {
    switch (format) {
        case DEFREC_FORMAT_GRAY8:
            return 1;
        case DEFREC_FORMAT_BGR8:
        case DEFREC_FORMAT_RGB8:
            return 3;
        case DEFREC_FORMAT_BGRA8:
            return 4;
        default:
            return 0;
    }
}

// Replaces every zero that means "default".
inline void fill_defaults(defrec_rectify_params& params) {
    params.struct_size = sizeof params;
    if (params.source_stride == 0)
        params.source_stride = params.source_width * bytes_per_pixel(params.format);
    if (params.width == 0) params.width = params.source_width;
    if (params.height == 0) params.height = params.source_height;
    if (params.stride == 0) params.stride = params.width;
    if (params.saturation == 0) params.saturation = 235;
    if (params.highlight_radius == 0) params.highlight_radius = 4;
}

}  // namespace defrec
