// Sentences on frames of a camera, and on those of a codec that copied blocks.
#include "sdk/session/compression_watch.hpp"

#include <doctest/doctest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "sdk/client/library.hpp"
#include "sdk/input/compression/decisions.hpp"

using namespace defrec::cli;

namespace {

constexpr int kWidth = 480, kHeight = 272, kFrames = defrec::decisions::CompressedVideo::kFrames;

// Frames of noise, of which one block in so many is the frame before's; 0: none.
class Film {
  public:
    explicit Film(int copied) : copied_(copied) {}

    StereoFrame next() {
        const cv::Mat before = image_.clone();
        image_.create(kHeight, kWidth, CV_8U);
        random_.fill(image_, cv::RNG::UNIFORM, 60, 200);
        const int columns = kWidth / 16, rows = kHeight / 16;
        for (int i = 0; copied_ > 0 && !before.empty() && i < columns * rows; ++i) {
            const cv::Rect block(i % columns * 16, i / columns * 16, 16, 16);
            if ((i + index_) % copied_ == 0) before(block).copyTo(image_(block));
        }
        StereoFrame frame;
        frame.index = index_++;
        frame.left = frame.right = {image_.data, kWidth, kHeight, 1, image_.step[0]};
        return frame;
    }

  private:
    const int copied_;
    int index_ = 0;
    cv::RNG random_{17};
    cv::Mat image_;
};

defrec_result result_with(std::uint32_t state, const std::vector<std::uint8_t>& evidence) {
    auto result = initialised<defrec_result>();
    result.state = state;
    result.vertex_count = evidence.size();
    result.vertex_evidence = evidence.data();
    return result;
}

// All that is said of so many frames, and of the end.
std::string said(int copied, const defrec_result& result, int frames = kFrames) {
    Film film(copied);
    CompressionWatch watch;
    std::string all;
    for (int i = 0; i < frames; ++i) {
        const std::string text = watch.add(film.next(), result);
        CHECK((text.empty() || i == kFrames - 1));
        all += text;
    }
    return all + watch.conclude();
}

bool says(const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
}

const std::vector<std::uint8_t> kMost = {1, 3, 3, 0}, kFew = {2, 3, 0, 0};

}  // namespace

TEST_CASE("row 161: nothing is said of a camera's frames, with depth or without") {
    CHECK(said(0, result_with(DEFREC_TRACKING, kMost)) == "");
    CHECK(said(0, result_with(DEFREC_LOST, kMost)) == "");
}

TEST_CASE("row 161: strong compression is said once, after the first frames or at the end") {
    for (const int frames : {kFrames / 2, kFrames, 3 * kFrames}) {
        CAPTURE(frames);
        const std::string text = said(50, result_with(DEFREC_TRACKING, kMost), frames);
        CHECK(says(text, "strongly compressed"));
        CHECK_FALSE(says(text, "beyond use"));
        CHECK(says(text, "2.0 % of the blocks"));
        CHECK(text.find("The video") == text.rfind("The video"));
    }
}

TEST_CASE("row 161: depth that the calibration or a late view costs is not laid to compression") {
    for (const std::uint32_t reason : {DEFREC_REASON_CALIBRATION, DEFREC_REASON_VIEW_LATE}) {
        defrec_result result = result_with(DEFREC_TRACKING, kFew);
        result.reasons = reason;
        const std::string text = said(50, result);
        CHECK(says(text, "strongly compressed"));
        CHECK_FALSE(says(text, "beyond use"));
    }
}

TEST_CASE("row 161: borders of blocks tell of a codec that encodes each frame by itself") {
    const auto result = result_with(DEFREC_TRACKING, kFew);
    CompressionWatch watch;
    std::string text;
    Film film(0);
    for (int i = 0; i < kFrames; ++i) {
        StereoFrame frame = film.next();
        cv::Mat image(kHeight, kWidth, CV_8U, const_cast<std::uint8_t*>(frame.left.pixels));
        std::vector<std::uint8_t> bytes;
        cv::GaussianBlur(image, image, {}, 3);
        cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, 10});
        cv::imdecode(bytes, cv::IMREAD_GRAYSCALE).copyTo(image);
        text += watch.add(frame, result);
    }
    CHECK(says(text, "compressed beyond use: no depth in 75 % of the surface"));
    CHECK(says(text, "from one block of 8 px to the next"));
}

TEST_CASE("row 161: a video without depth is compressed beyond use, and the share is told") {
    CHECK(says(said(50, result_with(DEFREC_TRACKING, kFew)),
               "compressed beyond use: no depth in 75 % of the surface"));
    CHECK(says(said(50, result_with(DEFREC_LOST, kMost)), "no depth in 100 %"));
    CHECK(says(said(50, result_with(DEFREC_INITIALISING, {})), "no depth in 100 %"));
}
