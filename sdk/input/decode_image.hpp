// An encoded image, decoded.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::cli {

// Largest side of one image: both views may lie side by side, or one above the other.
inline constexpr std::uint64_t kMaxImageSide = 2 * DEFREC_MAX_SIDE;

// An image of 8 bits, gray or BGR; empty where the bytes are no whole image of sides up to that, in
// a format of image_header_size.
cv::Mat decode_image(const std::vector<unsigned char>& bytes);

// Likewise, of the depth and channels that the file has.
cv::Mat decode_unchanged(const std::vector<unsigned char>& bytes);

}  // namespace defrec::cli
