// A view's pictures through H.264 and back.
#include "sdk/scenes/writing/h264_pass.hpp"

#include <opencv2/imgproc.hpp>

#include "sdk/scenes/writing/render_command.hpp"

namespace defrec::cli {
namespace {

constexpr double kMiddleGray = 128;

}  // namespace

H264Pass::H264Pass(const std::filesystem::path& path, cv::Size size, double contrast)
    : file_(path), size_(size), contrast_(contrast) {
    // Chroma is at half size.
    const cv::Size even(size.width + size.width % 2, size.height + size.height % 2);
    if (!writer_.open(file_.temporary().string(), cv::CAP_FFMPEG,
                      cv::VideoWriter::fourcc('a', 'v', 'c', '1'), 25.0, even)) {
        throw RenderOutputError(
            "cannot encode H.264: this OpenCV has no encoder for it (Debian's libopencv-dev with "
            "ffmpeg has)");
    }
}

void H264Pass::write(const cv::Mat& bgr) {
    cv::Mat even;
    bgr.convertTo(even, -1, contrast_, kMiddleGray * (1.0 - contrast_));
    cv::copyMakeBorder(even, even, 0, size_.height % 2, 0, size_.width % 2, cv::BORDER_REPLICATE);
    writer_.write(even);
}

void H264Pass::end_writing() {
    writer_.release();
    reader_.open(file_.temporary().string(), cv::CAP_FFMPEG);
}

cv::Mat H264Pass::read() {
    cv::Mat even;
    if (!reader_.read(even)) {
        throw RenderOutputError("cannot read back '" + file_.temporary().string() +
                                "': the video is incomplete; is the disk full?");
    }
    cv::Mat bgr;
    even(cv::Rect(cv::Point(0, 0), size_))
        .convertTo(bgr, -1, 1.0 / contrast_, kMiddleGray * (1.0 - 1.0 / contrast_));
    return bgr;
}

}  // namespace defrec::cli
