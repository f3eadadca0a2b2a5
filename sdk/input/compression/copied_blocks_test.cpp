// Frames of a camera, of a codec that copied some of their blocks, of a screen and of a recorder
// that repeats frames.
#include "sdk/input/compression/copied_blocks.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <opencv2/imgproc.hpp>

using namespace defrec::cli;

namespace {

constexpr int kWidth = 480, kHeight = 270, kFrames = 8;

cv::Mat tissue(int frame) {
    cv::RNG random(7);
    cv::Mat image(kHeight + 40, kWidth + 40, CV_32F);
    random.fill(image, cv::RNG::NORMAL, 0, 60);
    cv::GaussianBlur(image, image, {}, 2);
    // It moves by three quarters of a pixel in a frame.
    cv::Mat moved;
    const double shift = 20 + 0.75 * frame;
    cv::warpAffine(image, moved, cv::Matx23d(1, 0, -shift, 0, 1, -20), {kWidth, kHeight},
                   cv::INTER_CUBIC);
    return moved * 3 + 120;
}

cv::Mat camera_frame(int frame, double noise) {
    cv::Mat image = tissue(frame), grain(image.size(), CV_32F), gray;
    cv::RNG random(static_cast<std::uint64_t>(100 + frame));
    random.fill(grain, cv::RNG::NORMAL, 0, noise);
    cv::Mat(image + grain).convertTo(gray, CV_8U);
    return gray;
}

using Change = std::function<void(cv::Mat& frame, const cv::Mat& before, int index)>;

std::optional<double> share(double noise, const Change& change) {
    CopiedBlocks blocks;
    cv::Mat before;
    for (int i = 0; i < kFrames; ++i) {
        cv::Mat frame = camera_frame(i, noise);
        if (i > 0) change(frame, before, i);
        blocks.add(frame);
        before = frame;
    }
    return blocks.share();
}

void as_it_is(cv::Mat&, const cv::Mat&, int) {}

}  // namespace

TEST_CASE("a camera copies nothing, however little noise it has") {
    for (const double noise : {0.0, 0.5, 2.0}) {
        CAPTURE(noise);
        CHECK(share(noise, as_it_is) == 0.0);
    }
}

TEST_CASE("blocks that a codec copied are counted, where they were and moved") {
    for (const cv::Point move : {cv::Point(0, 0), cv::Point(1, 0), cv::Point(-3, 2)}) {
        CAPTURE(move.x);
        // Others in each frame.
        const auto copy = [&](cv::Mat& frame, const cv::Mat& before, int index) {
            for (int y = 1; y < kHeight / 16 - 1; ++y)
                for (int x = 1; x < kWidth / 16 - 1; ++x) {
                    if ((x + 3 * y + index) % 10 != 0) continue;
                    const cv::Rect block(16 * x, 16 * y, 16, 16);
                    before(block + move).copyTo(frame(block));
                }
        };
        const std::optional<double> copied = share(1, copy);
        REQUIRE(copied);
        CHECK(*copied > 0.05);
        CHECK(*copied < 0.1);
    }
}

TEST_CASE("what stands still in all frames is of a screen, and repeated frames are a recorder's") {
    const auto screen = [](cv::Mat& frame, const cv::Mat& before, int) {
        const cv::Rect part(0, 0, kWidth / 4, kHeight);
        before(part).copyTo(frame(part));
    };
    CHECK(share(1, screen) == 0.0);
    const auto repeat = [](cv::Mat& frame, const cv::Mat& before, int index) {
        if (index % 2 == 1) before.copyTo(frame);
    };
    CHECK(share(1, repeat) == 0.0);
}

TEST_CASE("frames without texture tell nothing") {
    CHECK_FALSE(share(0, [](cv::Mat& frame, const cv::Mat&, int) { frame = cv::Scalar(90); }));
    CopiedBlocks one;
    CHECK_FALSE(one.share());
    one.add(camera_frame(0, 1));
    CHECK_FALSE(one.share());
}
