// The finest detail of images that are as sharp as their pixels, and of magnified ones.
#include "sdk/doctor/detail.hpp"

#include <doctest/doctest.h>

#include "sdk/doctor/test_texture.hpp"

using namespace defrec::cli;

namespace {

std::optional<int> finest(const cv::Mat& image) {
    DetailMeter meter;
    meter.add(image);
    return meter.finest_px();
}

}  // namespace

TEST_CASE("detail is as fine as pixels, or as those that were magnified") {
    CHECK(finest(texture(480, 270)) == 1);
    CHECK(finest(magnified(texture(480, 270), 2)) == 2);
    CHECK(finest(magnified(texture(480, 270), 4)) == 4);
}

TEST_CASE("borders, highlights and text tell nothing") {
    cv::Mat image = magnified(texture(480, 270), 2);
    cv::rectangle(image, {0, 0, 160, image.rows}, 0, cv::FILLED);
    for (int x = 200; x < 420; x += 9) cv::line(image, {x, 20}, {x + 3, 60}, 255);
    CHECK(finest(image) == 2);
}

TEST_CASE("images with little texture do not tell") {
    CHECK(finest(texture(480, 270, 0.2)) == std::nullopt);
    CHECK(finest(cv::Mat(270, 480, CV_8U, cv::Scalar(90))) == std::nullopt);
    CHECK(finest(texture(64, 64)) == std::nullopt);
    CHECK(finest(cv::Mat(8, 8, CV_8U, cv::Scalar(90))) == std::nullopt);
}
