// Views as OpenCV's images.
#pragma once

#include <opencv2/core.hpp>

#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

// The view's own pixels, which must not be written.
cv::Mat mat_of(const ImageView& view);
// The same in gray; of a gray view its own pixels.
cv::Mat gray_of(const ImageView& view);

}  // namespace defrec::cli
