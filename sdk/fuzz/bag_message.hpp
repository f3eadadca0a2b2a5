// What the fuzz targets of bags do with a message, whatever the bag's format.
#pragma once

#include <cstdlib>

#include "sdk/bag/ros_messages.hpp"
#include "sdk/input/ros_image.hpp"

namespace defrec::fuzz {

inline void require(bool is_true) {
    if (!is_true) std::abort();
}

// Not of more than a megapixel, so that decoding does not take all of the time.
inline bool is_small(const cli::BagMessage& message) {
    constexpr std::size_t kMostBytes = 4'000'000;
    if (message.topic->type == cli::kImageType) return message.data.size() < kMostBytes;
    const auto image = cli::read_compressed_image(message.data);
    return !image || image->bytes.size() < kMostBytes / 100;
}

// As an image or a calibration.
inline void take(const cli::BagMessage& message) {
    require(message.topic != nullptr);
    if (message.topic->type == cli::kCameraInfoType) {
        const auto info = cli::read_camera_info(message.data);
        require(!info || info->d.size() <= message.data.size() / sizeof(double));
    }
    if (message.topic->type != cli::kImageType && message.topic->type != cli::kCompressedImageType)
        return;
    if (!is_small(message)) return;
    std::string fault;
    const cv::Mat image = cli::decode_ros_image(message, fault).image;
    require(image.empty() != fault.empty());
    require(image.empty() ||
            (image.depth() == CV_8U && (image.channels() == 1 || image.channels() == 3)));
}

}  // namespace defrec::fuzz
