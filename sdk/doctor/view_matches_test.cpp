// Matches of two views against the shift between them.
#include "sdk/doctor/view_matches.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgproc.hpp>

using namespace defrec::cli;

TEST_CASE("a picture is found where it was moved to, to a tenth of a pixel") {
    for (const int width : {320, 900}) {
        cv::Mat noise(200, width + 100, CV_8U), picture;
        cv::RNG random(1);
        random.fill(noise, cv::RNG::UNIFORM, 20, 240);
        cv::GaussianBlur(noise, picture, {}, 4);
        cv::normalize(picture, picture, 30, 220, cv::NORM_MINMAX);
        const cv::Mat left = picture(cv::Rect(30, 20, width, 160)),
                      right = picture(cv::Rect(53, 24, width, 160));
        const auto matches = match_views(left, right);
        REQUIRE(matches.size() > 40);
        for (const ViewMatch& match : matches) {
            CHECK(match.left.x - match.right.x == doctest::Approx(23).epsilon(0.005));
            CHECK(match.left.y - match.right.y == doctest::Approx(4).epsilon(0.025));
        }
        CHECK(match_views(left, cv::Mat(left.size(), CV_8U, cv::Scalar(90))).empty());
    }
}
