// A textured plane before two cameras that look in parallel, for tests of depth.
#pragma once

#include <opencv2/imgproc.hpp>

#include "sdk/evaluation/data_sets/depth_meter.hpp"

namespace defrec::cli {

// Each pixel of the left view is `disparity` px farther left in the right one.
inline StereoFrame plane_frame(cv::Size size, int disparity) {
    cv::Mat wide(size.height, size.width + std::abs(disparity), CV_8U);
    cv::RNG random(7);
    random.fill(wide, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(wide, wide, {5, 5}, 1.2);
    const int left = std::max(0, -disparity), right = std::max(0, disparity);
    return frame_of(wide.colRange(left, left + size.width).clone(),
                    wide.colRange(right, right + size.width).clone(), 0);
}

// f 400 px, baseline 5 mm; the right view's principal point lies `offset` px farther right.
inline StereoCalibration plane_cameras(cv::Size size, double offset = 0) {
    StereoCalibration calibration;
    calibration.width = size.width;
    calibration.height = size.height;
    calibration.left.fx = calibration.left.fy = 400;
    calibration.left.cx = (size.width - 1) / 2.0;
    calibration.left.cy = (size.height - 1) / 2.0;
    calibration.right = calibration.left;
    calibration.right.cx += offset;
    calibration.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    calibration.translation = {-5, 0, 0};
    return calibration;
}

}  // namespace defrec::cli
