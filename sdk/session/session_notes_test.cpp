// Notes that are said at once.
#include "sdk/session/session_notes.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "sdk/client/library.hpp"
#include "sdk/doctor/test_texture.hpp"
#include "sdk/input/compression/decisions.hpp"

using namespace defrec::cli;

namespace {

ImageView view_of(const cv::Mat& image) {
    return {image.data, image.cols, image.rows, image.channels(), image.step[0]};
}

StereoFrame frame_of(const cv::Mat& left, const cv::Mat& right) {
    StereoFrame frame;
    frame.left = view_of(left);
    frame.right = view_of(right);
    return frame;
}

// What is said of these images, and of the black ones before them.
std::vector<std::string> said(const cv::Mat& image, const cv::Mat& right, int black) {
    const cv::Mat dark(image.size(), image.type(), cv::Scalar::all(0));
    const auto result = initialised<defrec_result>();
    SessionNotes notes;
    std::vector<std::string> all;
    for (int i = 0; i < black + 3; ++i) {
        const std::string note =
            notes.add_frame(i < black ? frame_of(dark, dark) : frame_of(image, right), result);
        if (!note.empty()) all.push_back(note);
    }
    CHECK(notes.all().size() == all.size());
    CHECK(notes.left_to_say().empty());
    return all;
}

cv::Mat turned(const cv::Mat& image) {
    cv::Mat other;
    cv::flip(image, other, 1);
    return other;
}

}  // namespace

TEST_CASE("images that were magnified are told once, of the first frames that show any texture") {
    const cv::Mat sharp = texture(480, 270);
    cv::Mat colour;
    cv::cvtColor(magnified(sharp, 4), colour, cv::COLOR_GRAY2BGR);
    for (const cv::Mat& image : {magnified(sharp, 4), colour}) {
        const std::vector<std::string> notes = said(image, turned(image), 2);
        REQUIRE(notes.size() == 1);
        CHECK(notes[0].find("The images hold no detail finer than 4 px") == 0);
        CHECK(notes[0].find("to a quarter") != std::string::npos);
    }
    CHECK(said(sharp, turned(sharp), 2).empty());
    CHECK(said(magnified(sharp, 4), turned(magnified(sharp, 4)),
               defrec::decisions::CompressedVideo::kFrames)
              .empty());
}

TEST_CASE("a view that is given twice is told once, of the first frames that show any texture") {
    const cv::Mat image = texture(480, 270);
    const std::vector<std::string> notes = said(image, image.clone(), 2);
    REQUIRE(notes.size() == 1);
    CHECK(notes[0].find("Left and right are the same images. Give the other view") == 0);
}
