// Sources of frames: what they deliver, and rows 51-56, 71 and 75: what is said when they do not.
#include "sdk/input/frame_source.hpp"

#include <doctest/doctest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string>

#include "sdk/input/image_stream.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

cv::Mat image_of(int value, cv::Size size = {96, 64}) {
    return cv::Mat(size, CV_8UC3, cv::Scalar::all(value));
}

// folder/name_0.png and so on, each of one gray value: base, base + 1, ...
std::string write_images(const std::string& folder, int count, int base,
                         const std::string& prefix = "") {
    std::filesystem::create_directories(folder);
    for (int i = 0; i < count; ++i) {
        cv::imwrite(folder + "/" + prefix + std::to_string(i) + ".png", image_of(base + i));
    }
    return folder;
}

std::string write_video(const std::string& path, int count, cv::Size size = {96, 64},
                        double fps = 25) {
    cv::VideoWriter writer(path, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), fps,
                           size);
    REQUIRE(writer.isOpened());
    for (int i = 0; i < count; ++i) writer.write(image_of(4 * i, size));
    return path;
}

SourceOptions two(const std::string& left, const std::string& right) {
    SourceOptions options;
    options.left = left;
    options.right = right;
    return options;
}

struct Outcome {
    std::vector<std::int64_t> indices;
    std::vector<int> left, right;  // first pixels
    double last_ms = 0;
    std::string fault;
};

Outcome read_all(const SourceOptions& options) {
    FrameSource source(options);
    Outcome outcome;
    StereoFrame frame;
    while (source.next(frame)) {
        outcome.indices.push_back(frame.index);
        outcome.left.push_back(frame.left.pixels[0]);
        outcome.right.push_back(frame.right.pixels[0]);
        outcome.last_ms = frame.timestamp_ms;
    }
    outcome.fault = source.fault();
    CHECK_FALSE(source.next(frame));
    return outcome;
}

std::string refusal(const SourceOptions& options) {
    return refusal_of([&] { FrameSource source(options); });
}

}  // namespace

TEST_CASE("folders are read in the order people count in, patterns in the order of their numbers") {
    const TestFolder folder;
    const std::string left = write_images(folder / "left", 12, 10, "f_");
    const std::string right = write_images(folder / "right", 12, 100, "f_");
    for (const SourceOptions& options :
         {two(left, right), two(left + "/f_%d.png", right + "/f_%d.png")}) {
        const Outcome outcome = read_all(options);
        CHECK(outcome.left == std::vector<int>{10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21});
        CHECK(outcome.right.back() == 111);
        CHECK(outcome.fault == "");
        CHECK(outcome.last_ms == doctest::Approx(11 * 1000.0 / 30));
    }
}

TEST_CASE("--frames A:B keeps the frame's own number") {
    const TestFolder folder;
    SourceOptions options =
        two(write_images(folder / "l", 6, 10), write_images(folder / "r", 6, 50));
    options.range = parse_frame_range("2:4");
    CHECK(FrameSource(options).expected() == 2);
    CHECK(read_all(options).indices == std::vector<std::int64_t>{2, 3});
    options.range = parse_frame_range("4:");
    CHECK(read_all(options).left == std::vector<int>{14, 15});
    options.range = parse_frame_range(":2");
    CHECK(read_all(options).left == std::vector<int>{10, 11});
    options.range = parse_frame_range("9:");
    CHECK_SAYS(refusal(options), "there is no frame 9, there are only 6, counted from 0");
    options.range = parse_frame_range("6:");
    CHECK_SAYS(refusal(options), "there is no frame 6, there are only 6, counted from 0");
    for (const char* text : {"", "3", "4:2", "3:3", "-1:2", "a:b", "1:2:3", "1.5:2"}) {
        CAPTURE(text);
        CHECK_THROWS_AS(parse_frame_range(text), CliError);
    }
}

namespace {

// Images whose top field is of gray value 10 i and whose bottom field is of 10 i + 5.
std::string write_interlaced(const std::string& folder, int count, int height = 64) {
    std::filesystem::create_directories(folder);
    for (int i = 0; i < count; ++i) {
        cv::Mat image = image_of(10 * i, {96, height});
        for (int y = 1; y < height; y += 2) image.row(y).setTo(cv::Scalar::all(10 * i + 5));
        cv::imwrite(folder + "/" + std::to_string(i) + ".png", image);
    }
    return folder;
}

// A texture that moves by 3 px a field, in the field's rows alone.
std::string write_moving(const std::string& folder, int count, bool is_interlaced,
                         bool is_top_first) {
    std::filesystem::create_directories(folder);
    cv::Mat wide(64, 96 + 6 * count, CV_8UC1);
    cv::RNG(5).fill(wide, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(wide, wide, {}, 2);
    cv::normalize(wide, wide, 0, 255, cv::NORM_MINMAX);
    for (int i = 0; i < count; ++i) {
        cv::Mat image(64, 96, CV_8UC1);
        for (int y = 0; y < 64; ++y) {
            const bool is_later = is_interlaced && (y % 2 == 1) == is_top_first;
            wide.row(y)
                .colRange(6 * i + (is_later ? 3 : 0), 6 * i + (is_later ? 3 : 0) + 96)
                .copyTo(image.row(y));
        }
        cv::imwrite(folder + "/" + std::to_string(i) + ".png", image);
    }
    return folder;
}

}  // namespace

TEST_CASE("each field of an image is a frame, in the order of their times") {
    const TestFolder folder;
    SourceOptions options =
        two(write_interlaced(folder / "l", 3), write_interlaced(folder / "r", 3));
    options.fps = 25;
    for (const bool is_top_first : {true, false}) {
        options.fields = is_top_first ? FieldOrder::kTopFirst : FieldOrder::kBottomFirst;
        options.range = {};
        FrameSource source(options);
        CHECK(source.fps() == 50);
        CHECK(source.expected() == 6);
        CHECK(source.fields() == options.fields);
        StereoFrame frame;
        for (int i = 0; i < 6; ++i) {
            REQUIRE(source.next(frame));
            const bool is_bottom = (i % 2 == 1) == is_top_first;
            CHECK(frame.index == i);
            CHECK(frame.timestamp_ms == doctest::Approx(20.0 * i));
            CHECK(frame.field == (is_bottom ? DEFREC_FIELD_BOTTOM : DEFREC_FIELD_TOP));
            for (const ImageView& view : {frame.left, frame.right})
                for (const int y : {0, 1, 31, 62, 63})
                    CHECK(view.pixels[static_cast<std::size_t>(y) * view.stride] ==
                          10 * (i / 2) + (is_bottom ? 5 : 0));
        }
        CHECK_FALSE(source.next(frame));
        options.range = {1, 4};
        const Outcome part = read_all(options);
        CHECK(part.indices == std::vector<std::int64_t>{1, 2, 3});
        CHECK(part.left == (is_top_first ? std::vector{5, 10, 15} : std::vector{0, 15, 10}));
        CHECK(part.last_ms == doctest::Approx(60));
        CHECK(FrameSource(options).expected() == 3);
        options.range = {8, {}};
        CHECK_SAYS(refusal(options), "there are only 6");
    }
}

TEST_CASE("rows of the other field lie between the field's own") {
    const TestFolder folder;
    std::filesystem::create_directories(folder / "l");
    cv::Mat image(65, 96, CV_8UC1);
    for (int y = 0; y < image.rows; ++y) image.row(y).setTo(y % 2 == 0 ? 2 * y : 255);
    cv::imwrite(folder / "l/0.png", image);
    SourceOptions options = two(folder / "l", folder / "l");
    options.fields = FieldOrder::kTopFirst;
    FrameSource source(options);
    StereoFrame frame;
    REQUIRE(source.next(frame));
    for (int y = 0; y < image.rows; ++y)
        CHECK(frame.left.pixels[static_cast<std::size_t>(y) * frame.left.stride] == 2 * y);
}

TEST_CASE("whether images are interlaced is told by the first of them that move") {
    const TestFolder folder;
    const auto fields_of = [&](const std::string& left) {
        SourceOptions options = two(left, left);
        options.fields = FieldOrder::kAuto;
        return FrameSource(options).fields();
    };
    CHECK(fields_of(write_moving(folder / "top", 9, true, true)) == FieldOrder::kTopFirst);
    CHECK(fields_of(write_moving(folder / "bottom", 9, true, false)) == FieldOrder::kBottomFirst);
    CHECK(fields_of(write_moving(folder / "whole", 9, false, false)) == FieldOrder::kProgressive);
    CHECK(fields_of(write_images(folder / "flat", 9, 50)) == FieldOrder::kProgressive);
    // Only the first images are interlaced.
    const std::filesystem::path mixed = write_moving(folder / "mixed", 12, true, true),
                                whole = write_moving(folder / "rest", 12, false, false);
    for (int i = 8; i < 12; ++i) {
        const std::filesystem::path name = std::to_string(i) + ".png";
        std::filesystem::copy_file(whole / name, mixed / name,
                                   std::filesystem::copy_options::overwrite_existing);
    }
    CHECK(fields_of(mixed.string()) == FieldOrder::kProgressive);
}

TEST_CASE("one source may carry both views") {
    const TestFolder folder;
    std::filesystem::create_directories(folder / "both");
    cv::Mat both(64, 192, CV_8UC3, cv::Scalar::all(20));
    both.colRange(96, 192).setTo(cv::Scalar::all(200));
    cv::imwrite(folder / "both/0.png", both);
    SourceOptions options;
    options.stereo = folder / "both";
    CHECK(read_all(options).left == std::vector<int>{20});
    CHECK(read_all(options).right == std::vector<int>{200});
    CHECK(FrameSource(options).width() == 96);
    options.layout = Layout::kTopBottom;
    CHECK(FrameSource(options).width() == 192);
    CHECK(FrameSource(options).height() == 32);
    cv::imwrite(folder / "both/0.png", both.rowRange(0, 63));
    CHECK_SAYS(refusal(options), "two halves");
}

TEST_CASE("gray and colour images of one pair are made alike") {
    const TestFolder folder;
    const SourceOptions options =
        two(write_images(folder / "l", 1, 10), write_images(folder / "r", 1, 50));
    cv::imwrite(folder / "l/0.png", cv::Mat(64, 96, CV_8UC1, cv::Scalar(10)));
    StereoFrame frame;
    REQUIRE(FrameSource(options).next(frame));
    CHECK(frame.left.channels == 3);
    cv::imwrite(folder / "r/0.png", cv::Mat(64, 96, CV_8UC1, cv::Scalar(10)));
    REQUIRE(FrameSource(options).next(frame));
    CHECK(frame.left.channels == 1);
}

TEST_CASE("row 51: images that do not pair up are refused before anything is tracked") {
    const TestFolder folder;
    const SourceOptions options =
        two(write_images(folder / "l", 6, 10), write_images(folder / "r", 6, 50));
    std::filesystem::remove(folder / "r/5.png");
    CHECK_SAYS(refusal(options), "6 images on the left");
    CHECK_SAYS(refusal(options), "Leave out the last image of the left view, or its first where");
    std::filesystem::remove(folder / "l/3.png");
    CHECK_SAYS(refusal(options), "4.png would be paired with");
    CHECK_SAYS(refusal(two(folder / "l/%d.png", folder / "r/%d.png")), "number 3 is missing");
}

TEST_CASE("numbers of left and right images that differ alike in all pairs are told") {
    const TestFolder folder;
    const auto remark = [](const SourceOptions& options) {
        return FrameSource(options).pairing_remark();
    };
    const std::string left = write_images(folder / "l", 4, 10),
                      right = write_images(folder / "r", 6, 50);
    std::filesystem::remove(folder / "r/0.png");
    std::filesystem::remove(folder / "r/1.png");
    CHECK_SAYS(remark(two(left, right)), "differ by 2: 0.png was paired with 2.png");
    CHECK(remark(two(left, write_images(folder / "same", 4, 50))).empty());
    CHECK(remark(two(write_images(folder / "a", 4, 10, "cam1_"),
                     write_images(folder / "b", 4, 50, "cam2_")))
              .empty());
}

TEST_CASE("row 125: views of different rates are refused when they are opened") {
    const TestFolder folder;
    const std::string slow = write_video(folder / "slow.avi", 5),
                      fast = write_video(folder / "fast.avi", 6, {96, 64}, 30),
                      about = write_video(folder / "about.avi", 6, {96, 64}, 29.97);
    const std::string said = refusal(two(fast, slow));
    CHECK_SAYS(said, "fast.avi has 30 images a second");
    CHECK_SAYS(said, "slow.avi has 25");
    CHECK(read_all(two(fast, about)).indices.size() == 6);
    SourceOptions stated = two(fast, slow);
    stated.fps = 25;
    CHECK(read_all(stated).indices.size() == 5);
}

TEST_CASE("row 56: a size that changes ends the sequence with an error message") {
    const TestFolder folder;
    const SourceOptions options =
        two(write_images(folder / "l", 4, 10), write_images(folder / "r", 4, 50));
    cv::imwrite(folder / "r/2.png", image_of(52, {100, 64}));
    const Outcome outcome = read_all(options);
    CHECK(outcome.indices.size() == 2);
    CHECK_SAYS(outcome.fault, "frame 2 is 100x64");
    cv::imwrite(folder / "r/0.png", image_of(50, {100, 64}));
    CHECK_SAYS(refusal(options), "of one size");
}

TEST_CASE("row 71: damaged images end the sequence after those that could be read") {
    const TestFolder folder;
    const SourceOptions options =
        two(write_images(folder / "l", 4, 10), write_images(folder / "r", 4, 50));
    folder.write("l/2.png", TestFolder::read(folder / "l/2.png").substr(0, 60));
    const Outcome outcome = read_all(options);
    CHECK(outcome.indices.size() == 2);
    CHECK_SAYS(outcome.fault, "2.png: this is not a whole image");

    cv::imwrite(folder / "cut.jpg", image_of(80, {400, 300}));
    std::filesystem::create_directories(folder / "j");
    const std::string jpeg = TestFolder::read(folder / "cut.jpg");
    folder.write("j/0.jpg", jpeg);
    folder.write("j/1.jpg", jpeg.substr(0, jpeg.size() / 2));
    const Outcome cut = read_all(two(folder / "j", folder / "j"));
    CHECK(cut.indices.size() == 1);
    CHECK_SAYS(cut.fault, "1.jpg");
}

TEST_CASE(
    "row 113: without a file descriptor the message says so, and not that the image is none") {
    const TestFolder folder;
    const std::string images = write_images(folder / "l", 4, 10);
    const std::string video = write_video(folder / "whole.avi", 3);
    FrameSource source(two(images, images));
    StereoFrame frame;
    REQUIRE(source.next(frame));
    std::string refused;
    {
        rlimit before{};
        ::getrlimit(RLIMIT_NOFILE, &before);
        const rlimit none{3, before.rlim_max};
        ::setrlimit(RLIMIT_NOFILE, &none);
        while (source.next(frame)) {
        }
        refused = refusal(two(video, video));
        ::setrlimit(RLIMIT_NOFILE, &before);
    }
    CHECK_SAYS(source.fault(), "Too many open files");
    CHECK_SAYS(refused, "Too many open files");
}

TEST_CASE("row 71: a video is read, and one that is cut short delivers what it has") {
    const TestFolder folder;
    const std::string whole = write_video(folder / "whole.avi", 30);
    const Outcome outcome = read_all(two(whole, whole));
    CHECK(outcome.indices.size() == 30);
    CHECK(outcome.fault == "");
    CHECK(outcome.last_ms == doctest::Approx(29 * 40.0));

    const std::string bytes = TestFolder::read(whole);
    const std::string cut = folder.write("cut.avi", bytes.substr(0, bytes.size() / 2));
    const Outcome half = read_all(two(whole, cut));
    CHECK(half.indices.size() > 0);
    CHECK(half.indices.size() < 30);
    CHECK_SAYS(half.fault, "cut.avi");

    const Outcome shorter = read_all(two(whole, write_video(folder / "short.avi", 10)));
    CHECK(shorter.indices.size() == 10);
    CHECK_SAYS(shorter.fault, "short.avi: it ends after 10 frames");
}

TEST_CASE("row 71: what is no source is refused with an error message") {
    const TestFolder folder;
    const std::string good = write_images(folder / "good", 1, 10);
    std::filesystem::create_directory(folder / "empty");
    CHECK_SAYS(refusal(two(folder / "absent", good)), "no such file");
    CHECK_SAYS(refusal(two(good, folder / "empty")), "no image");
    CHECK_SAYS(refusal(two(folder.write("text.mp4", "not a video"), good)), "not a video");
    CHECK_SAYS(refusal(two(folder.write("empty.mp4", ""), good)), "not a video");
    CHECK_SAYS(refusal(two("/dev/zero", good)), "is a camera and the other is not");
    CHECK_SAYS(refusal(two(folder / "good/x_%06d.png", good)), "no file matches");
    CHECK_SAYS(refusal(two(folder / "good/%s.png", good)), "no such file");
    CHECK_SAYS(refusal(two("/dev/video_absent", good)), "no such camera. `ls /dev/video*` lists");
    CHECK_SAYS(refusal(two("/dev/video_absent", "/dev/video_absent")), "no such camera");
}

TEST_CASE("row 75: paths are UTF-8") {
    const TestFolder folder;
    const std::string images = write_images(folder / "Läsion 肝", 2, 10);
    CHECK(read_all(two(images, images)).indices.size() == 2);
    const std::string video = write_video(folder / "Öl 胆.avi", 3);
    CHECK(read_all(two(video, video)).indices.size() == 3);
}

TEST_CASE("row 86: an image that claims more pixels than a view can have is not decoded") {
    const TestFolder folder;
    const std::string good = write_images(folder / "good", 1, 10),
                      huge = write_images(folder / "huge", 1, 10);
    // The sides in the header of a small file; its check sum no longer fits.
    std::fstream file(huge + "/0.png", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(16);
    file.write("\0\0\x75\x30\0\0\x75\x30", 8);
    file.close();
    CHECK_SAYS(refusal(two(huge, good)), "of sides up to 16384 px");
}

TEST_CASE("row 87: lists of other files, and what is no file, are not opened as videos") {
    const TestFolder folder;
    const std::string video = write_video(folder / "video.avi", 3);
    const std::string lists[] = {
        folder.write("concat.mp4", "ffconcat version 1.0\nfile video.avi\n"),
        folder.write("hls.mp4", "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nvideo.avi\n"),
        folder.write("itself.mp4", "ffconcat version 1.0\nfile itself.mp4\n")};
    for (const std::string& list : lists)
        CHECK_SAYS(refusal(two(list, video)), "not a video that can be opened");
    const std::string fifo = folder / "fifo.mp4";
    REQUIRE(::mkfifo(fifo.c_str(), 0600) == 0);
    CHECK_SAYS(refusal(two(fifo, video)), "neither a file nor a folder");
}
