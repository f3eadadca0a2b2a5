// Differences of measured depth from that of the Hamlyn data set.
#pragma once

#include <opencv2/core.hpp>

namespace defrec::cli {

// Over pixels where both have a depth; NaN without one.
struct HamlynErrors {
    double mean_abs_mm, rms_mm;
    double abs_rel;       // mean of |difference| / depth
    double within_share;  // with a ratio of the two, larger to smaller, below 1.25
    double found_share;   // of the pixels where the data set has a depth
};
// Both CV_32F of the same size, mm; 0: unknown.
HamlynErrors hamlyn_errors(const cv::Mat& truth, const cv::Mat& depth);

}  // namespace defrec::cli
