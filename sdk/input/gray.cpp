// See gray.hpp.
#include "sdk/input/gray.hpp"

#include <opencv2/imgproc.hpp>

namespace defrec::cli {

cv::Mat gray_of(const ImageView& view) {
    const cv::Mat image(view.height, view.width, CV_8UC(view.channels),
                        const_cast<std::uint8_t*>(view.pixels), view.stride);
    cv::Mat gray;
    if (view.channels == 1) return image;
    cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
    return gray;
}

}  // namespace defrec::cli
