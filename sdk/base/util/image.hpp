// Checks of the images and frames that an application hands in (docs/api/abi.md).
#pragma once
#include <cstdint>

#include "include/defrec_c.h"

namespace defrec {

// The application's image as the library sees it: struct_size settled, either pixels or memory
// given, the stride of pixels never 0, format known, sides within DEFREC_MIN_*..DEFREC_MAX_SIDE.
// what names it in error texts: "left".
defrec_image read_image(const char* what, const defrec_image* image);

// Throws unless the image has this size and format.
void expect_image(const char* what, const defrec_image& image, uint32_t width, uint32_t height,
                  uint32_t format);

// Bytes from the first to one past the last pixel.
uint64_t image_bytes(const defrec_image& image);

}  // namespace defrec
