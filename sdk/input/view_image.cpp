// See view_image.hpp.
#include "sdk/input/view_image.hpp"

#include <opencv2/imgproc.hpp>

namespace defrec::cli {

cv::Mat mat_of(const ImageView& view) {
    return {view.height, view.width, CV_8UC(view.channels), const_cast<std::uint8_t*>(view.pixels),
            view.stride};
}

cv::Mat gray_of(const ImageView& view) {
    if (view.channels == 1) return mat_of(view);
    cv::Mat gray;
    cv::cvtColor(mat_of(view), gray, cv::COLOR_BGR2GRAY);
    return gray;
}

}  // namespace defrec::cli
