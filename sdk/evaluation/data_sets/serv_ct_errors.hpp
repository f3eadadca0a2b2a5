// SERV-CT's errors of one image.
#pragma once

#include <opencv2/core.hpp>

namespace defrec::cli {

struct ServCtImage {
    cv::Mat true_depth, true_disparity;  // CV_32F, mm and px; 0: unknown
    cv::Mat occlusion;                   // CV_8UC3, blue green red
    cv::Mat depth;                       // CV_32F, mm, that was measured; 0: none
    // disparity = focal_baseline / depth + disparity_offset
    double focal_baseline = 0, disparity_offset = 0;
};

// Over pixels with truth where depth was measured; NaN without one.
struct ServCtErrors {
    double epe_px, rms_px, bad3_share;  // bad3: disparity off by more than 3 px
    double mae_mm, rms_mm, median_mm;
    double found_share;  // of the pixels with truth
};
// only_visible: without the pixels that are marked as occluded.
ServCtErrors errors_of(const ServCtImage& image, bool only_visible);

}  // namespace defrec::cli
