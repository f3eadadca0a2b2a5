// Depth of stereo images, pixel by pixel, in the left camera as given.
#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "sdk/evaluation/data_sets/data_set.hpp"
#include "sdk/input/frame_source.hpp"
#include "sdk/io/calibration.hpp"

namespace defrec::cli {

// One thread at a time.
class DepthMeter {
  public:
    virtual ~DepthMeter() = default;
    // Depth of each pixel of the left image, mm along the optical axis, CV_32F; 0 where there is
    // none.
    virtual cv::Mat depth_of(const StereoFrame& frame) = 0;
};

// By the settings' method. Throws CliError.
std::unique_ptr<DepthMeter> make_depth_meter(const RunSettings& settings,
                                             const StereoCalibration& calibration, int channels);

// Two 8-bit images of the same size and type as a frame.
StereoFrame frame_of(const cv::Mat& left, const cv::Mat& right, std::int64_t index);

// Throws CliError(kInput) when there is no whole image. flags: of cv::imread.
cv::Mat read_image(const std::filesystem::path& path, int flags);

struct DepthErrors {
    double truth_share = 0;  // of the image, where depth is known
    double found_share = 0;  // of that, where depth was measured; NaN without truth
    // mm, over those pixels; NaN without them.
    double mean_abs_mm = 0, median_abs_mm = 0;
};
// Both CV_32F of the same size, mm. Unknown: 0, negative or not finite.
DepthErrors errors_of(const cv::Mat& truth, const cv::Mat& depth);

// The left image as JPEG, at most 480 px wide, with the error where it is known: blue 0, red 5 mm.
std::string error_picture(const cv::Mat& left, const cv::Mat& truth, const cv::Mat& depth);

}  // namespace defrec::cli
