#include "sdk/io/image_header.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

using namespace defrec::cli;

TEST_CASE("row 86: the size of an image is read from its header, of every format that is read") {
    const cv::Mat image(37, 53, CV_8UC3, cv::Scalar::all(70));
    for (const char* format : {".png", ".jpg", ".bmp", ".tif", ".ppm", ".webp"}) {
        CAPTURE(format);
        std::vector<unsigned char> bytes;
        REQUIRE(cv::imencode(format, image, bytes));
        const auto size = image_header_size(bytes);
        REQUIRE(size);
        CHECK(size->width == 53);
        CHECK(size->height == 37);
        for (std::size_t cut = 0; cut < std::min<std::size_t>(bytes.size(), 400); ++cut)
            image_header_size(std::span(bytes).first(cut));  // reads no further
    }
    const std::string text = "P5 # 1 2\n 30000\t20000 255\n";
    const auto size = image_header_size({reinterpret_cast<const unsigned char*>(text.data()), 26});
    REQUIRE(size);
    CHECK(size->width == 30000);
    CHECK(size->height == 20000);
    CHECK_FALSE(image_header_size({}));
}

TEST_CASE("row 86: a size that decoders read in different ways is none") {
    // OpenCV takes this for 2 x 5, other decoders for 2 x 4.
    for (const std::string text : {"P5 2# 5 2\n4 255\n", "P5 2 4# 5\n255\n", "P5 2x4 255\n"}) {
        CAPTURE(text);
        CHECK_FALSE(
            image_header_size({reinterpret_cast<const unsigned char*>(text.data()), text.size()}));
    }
}

TEST_CASE("row 87: lists that name other files are no videos") {
    const auto begins = [](const std::string& text) {
        return begins_video({reinterpret_cast<const unsigned char*>(text.data()), text.size()});
    };
    CHECK_FALSE(begins("ffconcat version 1.0\nfile secret.mp4\n"));
    CHECK_FALSE(begins("#EXTM3U\n#EXT-X-TARGETDURATION:1\nsecret.ts\n"));
    CHECK_FALSE(begins("file secret.mp4\n"));
    CHECK_FALSE(begins(""));
    CHECK(begins(std::string("\0\0\0\x18", 4) + "ftypisom"));
    CHECK(begins("RIFF1234AVI LIST"));
    CHECK(begins("\x1A\x45\xDF\xA3 webm"));
}
