// An image of a bag as OpenCV has it.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>

#include "sdk/bag/bag_reader.hpp"

namespace defrec::cli {

struct StampedImage {
    cv::Mat image;  // of its own, 8 bits, gray or BGR
    std::int64_t stamp_ns = 0;
};

// message: of a topic of images. fault: why there is none, as a sentence; empty otherwise.
StampedImage decode_ros_image(const BagMessage& message, std::string& fault);
// The header's stamp alone; false where the message is damaged.
bool read_stamp(const BagMessage& message, std::int64_t& stamp_ns);

}  // namespace defrec::cli
