// Images of a camera, and of a codec that rounds blocks of 8 px each by itself.
#include "sdk/input/compression/block_borders.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "sdk/input/compression/compression_signs.hpp"

using namespace defrec::cli;

namespace {

constexpr int kWidth = 480, kHeight = 270;

cv::Mat camera_image(std::uint64_t seed) {
    cv::RNG random(seed);
    cv::Mat image(kHeight, kWidth, CV_32F), grain(image.size(), CV_32F), gray;
    random.fill(image, cv::RNG::NORMAL, 0, 60);
    cv::GaussianBlur(image, image, {}, 2);
    random.fill(grain, cv::RNG::NORMAL, 0, 1);
    cv::Mat(3 * image + 120 + grain).convertTo(gray, CV_8U);
    return gray;
}

cv::Mat compressed(const cv::Mat& image, int quality) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
    return cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
}

double ratio(const cv::Mat& image) {
    BlockBorders borders;
    borders.add(image);
    return borders.ratio();
}

}  // namespace

TEST_CASE("borders of blocks stand out the more the stronger the compression, along either side") {
    const cv::Mat image = camera_image(3);
    CHECK(ratio(image) < 1.05);
    CHECK(ratio(compressed(image, 10)) > 1.5);
    CHECK(ratio(compressed(image, 10)) > ratio(compressed(image, 40)));
    cv::Mat edges = image.clone();
    for (int y = 8; y < edges.rows; y += 16)
        edges.rowRange(y, std::min(y + 8, edges.rows)) += cv::Scalar(15);
    CHECK(ratio(edges) > 1.25);
    CHECK(ratio(edges.t()) == doctest::Approx(ratio(edges)).epsilon(0.01));
}

TEST_CASE("black bars that begin on the grid of the blocks are no compression") {
    for (const bool is_compressed : {false, true}) {
        cv::Mat image = camera_image(3);
        if (is_compressed) image = compressed(image, 10);
        for (cv::Mat bar : {image.rowRange(0, 40), image.rowRange(224, kHeight),
                            image.colRange(0, 80), image.colRange(400, kWidth)})
            bar.setTo(cv::Scalar(0));
        CAPTURE(is_compressed);
        CHECK((ratio(image) > 1.25) == is_compressed);
    }
}

TEST_CASE("black images have no borders") {
    CHECK(ratio(cv::Mat::zeros(kHeight, kWidth, CV_8U)) == 1);
}

TEST_CASE("the view that shows more of it tells of compression") {
    CompressionMeter meter;
    for (std::uint64_t i = 0; !meter.is_complete(); ++i)
        meter.add(camera_image(i), compressed(camera_image(50 + i), 10));
    CHECK(meter.signs().has_borders());
    CHECK_FALSE(meter.signs().has_copies());
    CHECK(meter.signs().seen().find("from one block of 8 px to the next") != std::string::npos);
}
