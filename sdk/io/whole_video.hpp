// OpenCV's video writer does not tell when the disk is full, so what was written is read.
#pragma once

#include <cstdint>
#include <opencv2/videoio.hpp>
#include <string>

namespace defrec::cli {

// As many as the file says; 0 where it cannot be opened, or the last of them does not decode.
inline std::int64_t readable_frames(const std::string& path) {
    cv::VideoCapture video(path, cv::CAP_FFMPEG);
    if (!video.isOpened()) return 0;
    const auto frames = static_cast<std::int64_t>(video.get(cv::CAP_PROP_FRAME_COUNT));
    video.set(cv::CAP_PROP_POS_FRAMES, static_cast<double>(frames - 1));
    return video.grab() ? frames : 0;
}

}  // namespace defrec::cli
