// STIR's metrics of predicted points.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

namespace defrec::cli {

// Distance of each predicted point to the nearest true one, whichever that is. There is at least
// one true point.
std::vector<double> nearest_errors(const std::vector<cv::Point3d>& predicted,
                                   const std::vector<cv::Point3d>& truth);

inline constexpr std::array<double, 5> kStirPixels{4, 8, 16, 32, 64};
inline constexpr std::array<double, 5> kStirMillimetres{2, 4, 8, 16, 32};

// The shares of errors of at most each threshold, then their mean; NaN for no errors.
std::array<double, 6> shares_within(const std::vector<double>& errors,
                                    const std::array<double, 5>& thresholds);

// Centre of the bounding rectangle of each contour of a segmentation: x + w / 2, y + h / 2, rounded
// down. Rectangles in the order of the contours.
struct StirMark {
    cv::Rect box;
    cv::Point centre() const { return {box.x + box.width / 2, box.y + box.height / 2}; }
};
std::vector<StirMark> stir_marks(const cv::Mat& segmentation);

// Marks of both views in the same image of the tissue. Each left mark's right centre is the one
// whose nearest_surface, of the size of the left mark, correlate best, among those at most 10 rows
// away and 8 to 105 px of disparity; where there is none the mark has no place in 3D.
struct StirStereo {
    double fx = 0, cx = 0, cy = 0, right_cx = 0, baseline_mm = 0;
};
std::vector<cv::Point3d> stir_places(const std::vector<StirMark>& left,
                                     const std::vector<StirMark>& right, const cv::Mat& left_image,
                                     const cv::Mat& right_image, const StirStereo& stereo);

}  // namespace defrec::cli
