// See ros_image.hpp. The names of encodings are those of sensor_msgs/image_encodings.hpp.
#include "sdk/input/ros_image.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string_view>

#include "sdk/bag/ros_messages.hpp"
#include "sdk/input/decode_image.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr int kAsItIs = -1;

struct Encoding {
    std::string_view name;
    int channels;
    int conversion;  // cv::COLOR_*
};
constexpr std::array kEncodings = {
    Encoding{"mono8", 1, kAsItIs},
    Encoding{"8UC1", 1, kAsItIs},
    Encoding{"bgr8", 3, kAsItIs},
    Encoding{"8UC3", 3, kAsItIs},
    Encoding{"rgb8", 3, cv::COLOR_RGB2BGR},
    Encoding{"bgra8", 4, cv::COLOR_BGRA2BGR},
    Encoding{"8UC4", 4, cv::COLOR_BGRA2BGR},
    Encoding{"rgba8", 4, cv::COLOR_RGBA2BGR},
};

std::string damaged(const BagMessage& message) {
    return "is no " + message.topic->type + " in CDR; it is damaged.";
}

std::string refused_encoding(std::string_view encoding) {
    const bool is_bayer = encoding.starts_with("bayer_");
    const bool has_16_bits = encoding.ends_with("16") || encoding.starts_with("16");
    return "has the encoding '" + printable(encoding.substr(0, 40)) +
           "'; mono8, rgb8, bgr8, rgba8 and bgra8 are read. " +
           (is_bayer ? "Debayer it: the node `debayer` of image_proc makes image_color of "
                       "image_raw; record that."
            : has_16_bits
                ? "Reduce it to 8 bits by a scale that suits its range, and record that."
                : "Have the camera's driver deliver one of these, or convert with cv_bridge, and "
                  "record that.");
}

cv::Mat take_pixels(const RosImage& message, std::string& fault) {
    const auto encoding =
        std::find_if(kEncodings.begin(), kEncodings.end(),
                     [&](const Encoding& each) { return each.name == message.encoding; });
    if (encoding == kEncodings.end()) {
        fault = refused_encoding(message.encoding);
        return {};
    }
    const std::uint64_t row =
        std::uint64_t{message.width} * static_cast<unsigned>(encoding->channels);
    const bool has_size = message.width > 0 && message.height > 0 &&
                          message.width <= kMaxImageSide && message.height <= kMaxImageSide;
    const bool has_pixels =
        has_size && message.step >= row &&
        message.pixels.size() >= std::uint64_t{message.step} * (message.height - 1) + row;
    if (!has_pixels) {
        fault = "is of " + std::to_string(message.width) + "x" + std::to_string(message.height) +
                " in rows of " + std::to_string(message.step) + " bytes, and has " +
                std::to_string(message.pixels.size()) + " bytes; sides up to " +
                std::to_string(kMaxImageSide) + " and all of their pixels were expected.";
        return {};
    }
    const cv::Mat pixels(static_cast<int>(message.height), static_cast<int>(message.width),
                         CV_8UC(encoding->channels),
                         const_cast<unsigned char*>(message.pixels.data()), message.step);
    if (encoding->conversion == kAsItIs) return pixels.clone();
    cv::Mat image;
    cv::cvtColor(pixels, image, encoding->conversion);
    return image;
}

cv::Mat decode(const RosCompressedImage& message, std::string& fault) {
    constexpr std::array<unsigned char, 2> kJpeg = {0xFF, 0xD8};
    constexpr std::array<unsigned char, 4> kPng = {0x89, 'P', 'N', 'G'};
    const auto begins_with = [&](const auto& magic) {
        return message.bytes.size() > magic.size() &&
               std::equal(magic.begin(), magic.end(), message.bytes.begin());
    };
    if (!begins_with(kJpeg) && !begins_with(kPng)) {
        fault = "is compressed as '" + printable(message.format.substr(0, 40)) +
                "'; JPEG and PNG are read. Record the topic of whole images.";
        return {};
    }
    cv::Mat image = decode_image({message.bytes.begin(), message.bytes.end()});
    if (image.empty())
        fault = "is not a whole image of sides up to " + std::to_string(kMaxImageSide) + " px.";
    return image;
}

}  // namespace

StampedImage decode_ros_image(const BagMessage& message, std::string& fault) {
    StampedImage decoded;
    if (message.topic->type == kImageType) {
        const std::optional<RosImage> image = read_image(message.data);
        if (!image) fault = damaged(message);
        if (image) decoded = {take_pixels(*image, fault), image->stamp_ns};
    } else {
        const std::optional<RosCompressedImage> image = read_compressed_image(message.data);
        if (!image) fault = damaged(message);
        if (image) decoded = {decode(*image, fault), image->stamp_ns};
    }
    return decoded;
}

bool read_stamp(const BagMessage& message, std::int64_t& stamp_ns) {
    const auto take = [&](const auto& image) {
        if (image) stamp_ns = image->stamp_ns;
        return image.has_value();
    };
    return message.topic->type == kImageType ? take(read_image(message.data))
                                             : take(read_compressed_image(message.data));
}

}  // namespace defrec::cli
