// A view's pictures through H.264 and back, by OpenCV's FFmpeg.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

#include "sdk/base/os/atomic_file.hpp"

namespace defrec::cli {

/// First every picture is written, then every picture is read. The video lies beside `path` and
/// goes with the pass.
class H264Pass {
  public:
    /// OpenCV leaves x264's rate factor at 23. contrast: 0..1, of the encoded picture; half the
    /// contrast doubles the steps of the quantiser, as a rate factor of 6 more does. Throws
    /// RenderOutputError where OpenCV cannot encode H.264.
    H264Pass(const std::filesystem::path& path, cv::Size size, double contrast);

    void write(const cv::Mat& bgr);
    void end_writing();
    /// The next picture. Throws RenderOutputError where the video has none.
    cv::Mat read();

  private:
    AtomicFile file_;  ///< never committed
    cv::Size size_;
    double contrast_;
    cv::VideoWriter writer_;
    cv::VideoCapture reader_;
};

}  // namespace defrec::cli
