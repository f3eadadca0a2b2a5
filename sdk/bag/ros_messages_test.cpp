// Messages of ROS 2 in CDR of either byte order.
#include "sdk/bag/ros_messages.hpp"

#include <doctest/doctest.h>

#include "sdk/bag/test_bag.hpp"

using namespace defrec::cli;

namespace {

constexpr std::int64_t kStamp = 1'700'000'000'123'456'789;

std::string_view text_of(ByteView bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

TEST_CASE("an image, of either byte order and with any length of texts before it") {
    for (const auto order : {ByteWriter::Order::kLittle, ByteWriter::Order::kBig})
        for (const char* encoding : {"mono8", "bgr8", "", "bayer_rggb8"}) {
            const std::string message =
                image_message(kStamp, {3, 2, encoding, 4, "abcdefgh"}, order);
            const auto image = read_image(bytes_of(message));
            REQUIRE(image);
            CHECK(image->stamp_ns == kStamp);
            CHECK(image->width == 3);
            CHECK(image->height == 2);
            CHECK(image->encoding == encoding);
            CHECK(image->step == 4);
            CHECK(text_of(image->pixels) == "abcdefgh");
            // A message that is cut anywhere is none.
            for (std::size_t size = 0; size < message.size(); ++size)
                CHECK_FALSE(read_image(bytes_of(message).first(size)));
        }
    // Bytes as `ros2 bag` has them of an image of 2x1 at 1 s and 2 ns in frame "cam".
    const std::string raw(
        "\0\1\0\0"
        "\1\0\0\0"
        "\2\0\0\0"
        "\4\0\0\0cam\0"
        "\1\0\0\0"
        "\2\0\0\0"
        "\6\0\0\0mono8\0"
        "\0\0"
        "\2\0\0\0"
        "\2\0\0\0xy",
        50);
    const auto image = read_image(bytes_of(raw));
    REQUIRE(image);
    CHECK(image->stamp_ns == 1'000'000'002);
    CHECK(image->width == 2);
    CHECK(image->height == 1);
    CHECK(text_of(image->pixels) == "xy");
}

TEST_CASE("a compressed image") {
    const std::string message = compressed_message(-5'000'000'000, "jpeg", "bytes");
    const auto image = read_compressed_image(bytes_of(message));
    REQUIRE(image);
    CHECK(image->stamp_ns == -5'000'000'000);
    CHECK(image->format == "jpeg");
    CHECK(text_of(image->bytes) == "bytes");
    CHECK_FALSE(read_compressed_image(bytes_of(message).first(message.size() - 1)));
}

TEST_CASE("a camera_info, of either byte order and with any distortion") {
    for (const auto order : {ByteWriter::Order::kLittle, ByteWriter::Order::kBig})
        for (const std::size_t count : {0, 5, 8}) {
            RosCameraInfo given;
            given.width = 640;
            given.height = 480;
            given.distortion_model = "plumb_bob";
            given.d.assign(count, 0.25);
            for (std::size_t i = 0; i < 9; ++i) given.k[i] = static_cast<double>(i) + 0.5;
            given.r[4] = -1;
            given.p[3] = -3.2;
            given.binning_x = 2;
            given.roi_width = 7;
            const std::string message = camera_info_message(given, order);
            const auto info = read_camera_info(bytes_of(message));
            REQUIRE(info);
            CHECK(info->width == 640);
            CHECK(info->height == 480);
            CHECK(info->distortion_model == "plumb_bob");
            CHECK(info->d == given.d);
            CHECK(info->k == given.k);
            CHECK(info->r == given.r);
            CHECK(info->p == given.p);
            CHECK(info->binning_x == 2);
            CHECK(info->roi_width == 7);
            CHECK(info->roi_height == 0);
        }
}

TEST_CASE(
    "other representations, texts that do not end and lengths beyond the message are refused") {
    std::string message = image_message(0, {1, 1, "mono8", 1, "x"});
    REQUIRE(read_image(bytes_of(message)));
    message[1] = 3;  // a list of parameters
    CHECK_FALSE(read_image(bytes_of(message)));
    message[1] = 1;
    message[4 + 8 + 4 + 6] = 'x';  // what ends the frame's name
    CHECK_FALSE(read_image(bytes_of(message)));
    message = image_message(0, {1, 1, "mono8", 1, "x"});
    message[message.size() - 2] = 127;
    CHECK_FALSE(read_image(bytes_of(message)));
    CHECK_FALSE(read_camera_info({}));
}
