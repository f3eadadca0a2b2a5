// Messages of ROS 2 as bags have them: serialised as CDR (OMG, Common Data Representation, as used
// by DDSI-RTPS), of either byte order.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "sdk/bag/byte_reader.hpp"

namespace defrec::cli {

inline constexpr std::string_view kImageType = "sensor_msgs/msg/Image";
inline constexpr std::string_view kCompressedImageType = "sensor_msgs/msg/CompressedImage";
inline constexpr std::string_view kCameraInfoType = "sensor_msgs/msg/CameraInfo";

// Texts and bytes are views of the message.
struct RosImage {
    std::int64_t stamp_ns = 0;  // of the header
    std::uint32_t width = 0, height = 0;
    std::string_view encoding;
    std::uint32_t step = 0;  // bytes from row to row
    ByteView pixels;
};

struct RosCompressedImage {
    std::int64_t stamp_ns = 0;
    std::string_view format;
    ByteView bytes;
};

struct RosCameraInfo {
    std::uint32_t width = 0, height = 0;
    std::string_view distortion_model;
    std::vector<double> d;
    std::array<double, 9> k{}, r{};
    std::array<double, 12> p{};
    std::uint32_t binning_x = 0, binning_y = 0;  // 0 and 1: none
    // The part of the sensor's image; all 0: the whole.
    std::uint32_t roi_x = 0, roi_y = 0, roi_height = 0, roi_width = 0;
};

// Empty where the bytes are not such a message.
std::optional<RosImage> read_image(ByteView message);
std::optional<RosCompressedImage> read_compressed_image(ByteView message);
std::optional<RosCameraInfo> read_camera_info(ByteView message);

}  // namespace defrec::cli
