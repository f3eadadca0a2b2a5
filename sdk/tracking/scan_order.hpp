// How the rows of a video's images follow each other in time.
#pragma once
#include <cstdint>

#include "include/defrec_c.h"

namespace defrec {

// DEFREC_SCAN_*. Two consecutive images of one view, checked, of one size and format, with pixels.
uint32_t scan_order(const defrec_image& earlier, const defrec_image& later);

}  // namespace defrec
