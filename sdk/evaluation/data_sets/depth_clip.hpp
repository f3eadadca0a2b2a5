// A clip of which depth is measured frame by frame.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sdk/evaluation/data_sets/depth_meter.hpp"

namespace defrec::cli {

class DepthClip {
  public:
    DepthClip(const ClipTask& task, const DataSet& data_set);

    // Frames from here on are of this calibration, whose size is known.
    void begin(const StereoCalibration& calibration, int channels);
    // Depth as DepthMeter has it.
    cv::Mat measure(const StereoFrame& frame);
    // Writes depth/<frame>.tiff, one float for each pixel, mm, 0 unknown.
    void write(std::int64_t frame, const cv::Mat& depth) const;
    // The frame is shown with its remark if its error is the largest.
    void consider(double error, const StereoFrame& frame, const cv::Mat& truth,
                  const cv::Mat& depth, const std::string& remark);

    Samples& samples() { return score_.samples; }
    ClipScore finish();

  private:
    const ClipTask& task_;
    ClipScore score_;
    std::unique_ptr<DepthMeter> meter_;
    std::vector<double> times_;  // ms, of each frame
    double worst_ = -1;
};

}  // namespace defrec::cli
