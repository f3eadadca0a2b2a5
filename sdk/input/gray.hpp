// A view in gray.
#pragma once

#include <opencv2/core.hpp>

#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

// A gray view's own pixels, without a copy.
cv::Mat gray_of(const ImageView& view);

}  // namespace defrec::cli
