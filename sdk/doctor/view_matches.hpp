// Matches places of the left view with those of the right one, without a calibration.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace defrec::cli {

// Pixels of the images as the cameras delivered them.
struct ViewMatch {
    cv::Point2d left, right;
    int pair = 0;  // which of several pairs of images it is of
};

// Gray images of one size.
std::vector<ViewMatch> match_views(const cv::Mat& left, const cv::Mat& right);

}  // namespace defrec::cli
