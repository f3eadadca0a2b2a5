// Sizes of the pixel formats.
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

}  // namespace defrec
