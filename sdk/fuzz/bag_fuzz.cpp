// A bag: an MCAP file, its topics, and its messages as images and calibrations.
#include <cstdlib>

#include "sdk/bag/mcap_reader.hpp"
#include "sdk/bag/ros_messages.hpp"
#include "sdk/bag/stereo_topics.hpp"
#include "sdk/fuzz/memory_file.hpp"
#include "sdk/input/ros_image.hpp"
#include "sdk/io/exit_code.hpp"

namespace {

using namespace defrec::cli;

void require(bool is_true) {
    if (!is_true) std::abort();
}

// Not of more than a megapixel, so that decoding does not take all of the time.
bool is_small(const BagMessage& message) {
    constexpr std::size_t kMostBytes = 4'000'000;
    if (message.topic->type == kImageType) return message.data.size() < kMostBytes;
    const auto image = read_compressed_image(message.data);
    return !image || image->bytes.size() < kMostBytes / 100;
}

void take(const BagMessage& message) {
    require(message.topic != nullptr);
    if (message.topic->type == kCameraInfoType) {
        const auto info = read_camera_info(message.data);
        require(!info || info->d.size() <= message.data.size() / sizeof(double));
    }
    if (message.topic->type != kImageType && message.topic->type != kCompressedImageType) return;
    if (!is_small(message)) return;
    std::string fault;
    const cv::Mat image = decode_ros_image(message, fault).image;
    require(image.empty() != fault.empty());
    require(image.empty() ||
            (image.depth() == CV_8U && (image.channels() == 1 || image.channels() == 3)));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const defrec::fuzz::MemoryFile file({data, size});
    try {
        McapReader reader(file.path());
        BagMessage message;
        while (reader.next(message)) take(message);
        static_cast<void>(choose_topics("fuzz", topics_of_mcap(file.path()), "", ""));
    } catch (const CliError&) {
    }
    return 0;
}
