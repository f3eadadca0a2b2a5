// Pairs of images of a bag: which belong together, what they show, and what is told of the rest.
#include "sdk/input/bag_source.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>

#include "sdk/bag/test_bag.hpp"
#include "sdk/input/frame_source.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::int64_t kStart = 1'700'000'000'000 * kMillisecond;

struct Stamp {
    char view;  // 'l' or 'r'
    double ms;
};

// Gray images of 4x2, whose pixels are the numbers of their messages from 0 on, and other topics.
std::string bag_of(const TestFolder& folder, const std::vector<Stamp>& stamps) {
    McapWriter writer;
    const auto left = writer.add_channel("/left/image_raw", kImageType);
    const auto other = writer.add_channel("/tf", "tf2_msgs/msg/TFMessage");
    const auto right = writer.add_channel("/right/image_raw", kImageType);
    char number = 0;
    for (const Stamp& stamp : stamps) {
        writer.add(stamp.view == 'l' ? left : right,
                   image_message(kStart + static_cast<std::int64_t>(stamp.ms * 1e6),
                                 {4, 2, "mono8", 5, std::string(10, number++)}));
        writer.add(other, "x");
    }
    return folder.write("bag.mcap", writer.finish());
}

std::string pairs_of(BagSource& source) {
    std::string text;
    CameraPair pair;
    while (source.read(pair))
        text += std::to_string(pair.left.image.at<unsigned char>(1, 3)) + "-" +
                std::to_string(pair.right.image.at<unsigned char>(0, 0)) + "@" +
                std::to_string(static_cast<int>(pair.left.time_ms)) + " ";
    return text;
}

std::string write_two(const TestFolder& folder, std::string_view type, const std::string& left,
                      const std::string& right) {
    McapWriter writer;
    writer.add(writer.add_channel("/left", type), left);
    writer.add(writer.add_channel("/right", type), right);
    return folder.write("two.mcap", writer.finish());
}

std::string fault_of(const std::string& path) {
    BagSource source({path, "", ""});
    CameraPair pair;
    while (source.read(pair)) continue;
    return source.fault();
}

}  // namespace

TEST_CASE("images are paired by their stamps, in whatever order they come") {
    const TestFolder folder;
    BagSource source({bag_of(folder, {{'l', 0},
                                      {'r', 0},
                                      {'r', 40},
                                      {'l', 40},
                                      {'l', 80},
                                      {'l', 120},
                                      {'r', 80},
                                      {'r', 121}}),
                      "", ""});
    CHECK(source.fps() == doctest::Approx(25));
    CHECK(source.claimed() == 4);
    CHECK(pairs_of(source) == "0-1@0 3-2@40 4-6@80 5-7@120 ");
    CHECK(source.fault() == "");
    const BagFacts facts = source.facts();
    CHECK(facts.left_topic == "/left/image_raw");
    CHECK(facts.pairs.pairs == 4);
    CHECK(facts.pairs.unpaired == 0);
    CHECK(facts.pairs.difference_sum_ms == doctest::Approx(1));
    CHECK(facts.remark() == "");
}

TEST_CASE("images without a partner are left out and told") {
    const TestFolder folder;
    BagSource source({bag_of(folder, {{'r', -40},
                                      {'l', 0},
                                      {'r', 0},
                                      {'l', 40},
                                      {'l', 80},
                                      {'r', 80},
                                      {'l', 120},
                                      {'r', 120},
                                      {'l', 160}}),
                      "", ""});
    CHECK(pairs_of(source) == "1-2@0 4-5@80 6-7@120 ");
    CHECK(source.fault() == "");
    CHECK(source.facts().pairs.unpaired == 3);
    CHECK(source.facts().remark() ==
          "3 images of the bag have no partner in the other view within half of a frame, and were "
          "left out.");
}

TEST_CASE("row 199: a view that ends early, or views of two clocks, are told") {
    const TestFolder folder;
    std::vector<Stamp> stamps;
    for (int i = 0; i < 20; ++i) {
        stamps.push_back({'l', 40.0 * i});
        if (i < 9) stamps.push_back({'r', 40.0 * i});
    }
    BagSource early({bag_of(folder, stamps), "", ""});
    CameraPair pair;
    int pairs = 0;
    while (early.read(pair)) ++pairs;
    CHECK(pairs == 9);
    CHECK_SAYS(early.fault(),
               "topic /right/image_raw ends after 9 images, but the other view goes on for 11");
    CHECK_SAYS(fault_of(bag_of(folder, {{'l', 0}, {'r', 1000}, {'l', 40}, {'r', 1040}})),
               "no images of the two views are of one time: the first of /left/image_raw has the "
               "stamp 1700000000.000000 s, that of /right/image_raw 1700000001.000000 s");
}

TEST_CASE("row 199: stamps that do not grow end the reading") {
    const TestFolder folder;
    CHECK_SAYS(
        fault_of(bag_of(folder, {{'l', 0}, {'r', 0}, {'l', 40}, {'r', 40}, {'l', 20}, {'r', 20}})),
        "the stamps of topic /left/image_raw do not grow: after 40.000 ms comes 20.000 ms");
}

TEST_CASE("images are as their encoding says") {
    const TestFolder folder;
    const auto pair_of = [&](const TestImage& image) {
        BagSource source({write_two(folder, kImageType, image_message(0, image),
                                    image_message(0, image, ByteWriter::Order::kBig)),
                          "", ""});
        CameraPair pair;
        REQUIRE(source.read(pair));
        REQUIRE(cv::norm(pair.left.image, pair.right.image, cv::NORM_INF) == 0);
        return pair.left.image;
    };
    const cv::Vec3b blue_green_red(1, 2, 3);
    for (const TestImage& image :
         {TestImage{1, 1, "bgr8", 3, "\1\2\3"}, TestImage{1, 1, "rgb8", 4, "\3\2\1\t"},
          TestImage{1, 1, "bgra8", 4, "\1\2\3\t"}, TestImage{1, 1, "rgba8", 4, "\3\2\1\t"},
          TestImage{1, 1, "8UC3", 3, "\1\2\3"}}) {
        CAPTURE(image.encoding);
        CHECK(pair_of(image).at<cv::Vec3b>(0, 0) == blue_green_red);
    }
    const cv::Mat gray = pair_of({2, 2, "mono8", 3, "abxcd"});
    CHECK(gray.channels() == 1);
    CHECK(gray.at<unsigned char>(1, 0) == 'c');
    const auto refusal = [&](const TestImage& image) {
        return fault_of(
            write_two(folder, kImageType, image_message(0, image), image_message(0, image)));
    };
    CHECK_SAYS(refusal({1, 1, "bayer_rggb8", 1, "x"}), "Debayer it");
    CHECK_SAYS(refusal({1, 1, "mono16", 2, "xx"}), "'mono16'; mono8, rgb8");
    CHECK_SAYS(refusal({1, 1, "mono16", 2, "xx"}), "Reduce it to 8 bits");
    CHECK_SAYS(refusal({2, 1, "yuv422", 4, "xxxx"}), "convert with cv_bridge");
    CHECK_SAYS(refusal({2, 2, "mono8", 2, "xxx"}), "is of 2x2 in rows of 2 bytes, and has 3 bytes");
    CHECK_SAYS(refusal({2, 2, "mono8", 1, "xxxx"}), "rows of 1 bytes");
    CHECK_SAYS(refusal({0, 2, "mono8", 0, ""}), "is of 0x2");
    CHECK_SAYS(refusal({0xFFFFFFFF, 0xFFFFFFFF, "mono8", 0xFFFFFFFF, "x"}), "sides up to 16384");
    CHECK_SAYS(fault_of(write_two(folder, kImageType, "\0\1", image_message(0, {}))),
               "image 1 of topic /left is no sensor_msgs/msg/Image in CDR");
}

TEST_CASE("compressed images are decoded, without loss where they are") {
    const TestFolder folder;
    cv::Mat image(30, 40, CV_8UC3);
    cv::randu(image, 0, 256);
    for (const char* format : {".png", ".jpg"}) {
        std::vector<unsigned char> bytes;
        cv::imencode(format, image, bytes);
        const std::string message = compressed_message(
            0, format, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        BagSource source({write_two(folder, kCompressedImageType, message, message), "", ""});
        CameraPair pair;
        REQUIRE(source.read(pair));
        const cv::Mat expected = cv::imdecode(bytes, cv::IMREAD_COLOR);
        CHECK(cv::norm(pair.right.image, expected, cv::NORM_INF) == 0);
        const std::string cut = compressed_message(
            0, format, {reinterpret_cast<const char*>(bytes.data()), bytes.size() / 2});
        CHECK_SAYS(fault_of(write_two(folder, kCompressedImageType, cut, message)),
                   "is not a whole image");
    }
    const std::string video = compressed_message(0, "h264", std::string(20, '\1'));
    CHECK_SAYS(fault_of(write_two(folder, kCompressedImageType, video, video)),
               "compressed as 'h264'; JPEG and PNG are read");
}

TEST_CASE("frames of a bag have its stamps as times, also in a part of it") {
    const TestFolder folder;
    SourceOptions options;
    options.bag.path = bag_of(folder, {{'l', 0},
                                       {'r', 0},
                                       {'l', 40},
                                       {'r', 40},
                                       {'l', 83.25},
                                       {'r', 83.25},
                                       {'l', 120},
                                       {'r', 120}});
    CHECK(options.has_views());
    FrameSource source(options);
    CHECK(source.width() == 4);
    CHECK(source.channels() == 1);
    CHECK(source.fps() == doctest::Approx(25));
    CHECK(source.expected() == 4);
    CHECK_FALSE(source.is_live());
    CHECK_FALSE(source.camera_counts());
    StereoFrame frame;
    std::vector<double> times;
    while (source.next(frame)) times.push_back(frame.timestamp_ms);
    CHECK(times == std::vector<double>{0, 40, 83.25, 120});
    CHECK(source.fault() == "");
    REQUIRE(source.bag_facts());
    CHECK(source.bag_facts()->pairs.pairs == 4);

    options.range = {2, 3};
    FrameSource part(options);
    REQUIRE(part.next(frame));
    CHECK(frame.index == 2);
    CHECK(frame.timestamp_ms == 83.25);
    CHECK(frame.left.pixels[0] == 4);
    CHECK_FALSE(part.next(frame));
    options.range = {7, {}};
    CHECK_SAYS(refusal_of([&] { FrameSource(SourceOptions(options)); }), "there are only 4");
    options.left = options.right = "images";
    CHECK_FALSE(options.has_views());
}

TEST_CASE("images of one topic that hold both views are cut by their layout") {
    const TestFolder folder;
    const auto write = [&](const TestImage& image, const std::vector<double>& times_ms) {
        McapWriter writer;
        const auto both = writer.add_channel("/stereo/image_raw", kImageType);
        const auto info = writer.add_channel("/stereo/camera_info", kCameraInfoType);
        RosCameraInfo camera;
        for (const double ms : times_ms) {
            writer.add(both, image_message(kStart + static_cast<std::int64_t>(ms * 1e6), image));
            camera.k[0] = ms;
            writer.add(info, camera_info_message(camera));
        }
        return folder.write("both.mcap", writer.finish());
    };
    SourceOptions options;
    options.bag.has_stereo_images = true;
    options.bag.path = write({4, 2, "mono8", 5, "abcd-efgh-"}, {0, 40, 80});
    for (const Layout layout : {Layout::kSideBySide, Layout::kTopBottom}) {
        options.layout = layout;
        FrameSource source(options);
        const bool is_wide = layout == Layout::kSideBySide;
        CHECK(source.width() == (is_wide ? 2 : 4));
        CHECK(source.height() == (is_wide ? 2 : 1));
        CHECK(source.expected() == 3);
        CHECK(source.fps() == doctest::Approx(25));
        StereoFrame frame;
        for (int i = 0; i < 3; ++i) {
            REQUIRE(source.next(frame));
            CHECK(frame.timestamp_ms == 40.0 * i);
            CHECK(frame.left.pixels[1] == 'b');
            CHECK(frame.right.pixels[1] == (is_wide ? 'd' : 'f'));
            if (is_wide) CHECK(frame.right.pixels[frame.right.stride] == 'g');
        }
        CHECK_FALSE(source.next(frame));
        CHECK(source.fault() == "");
        REQUIRE(source.bag_facts());
        CHECK(source.bag_facts()->left_topic == "/stereo/image_raw");
        CHECK(source.bag_facts()->right_topic == "");
        CHECK(source.bag_facts()->pairs.unpaired == 0);
        CHECK_SAYS(source.bag_facts()->remark(), "topic /stereo/camera_info changes");
    }
    options.bag.path = write({4, 1, "mono8", 4, "abcd"}, {0, 40});
    CHECK_SAYS(refusal_of([&] { FrameSource(SourceOptions(options)); }),
               "an image of 4x1 cannot be cut into two halves one above the other");
    options.layout = Layout::kSideBySide;
    options.bag.path = write({4, 1, "mono8", 4, "abcd"}, {0, 40, 20});
    FrameSource source(options);
    StereoFrame frame;
    while (source.next(frame)) continue;
    CHECK_SAYS(source.fault(), "the stamps of topic /stereo/image_raw do not grow");
    options.bag.stereo_topic = "/stereo";
    CHECK_SAYS(refusal_of([&] { FrameSource(SourceOptions(options)); }), "no topic '/stereo'");
}

TEST_CASE("a calibration that changes in the recording is told") {
    const TestFolder folder;
    for (const bool changes : {false, true}) {
        McapWriter writer;
        const auto left = writer.add_channel("/left/image_raw", kImageType),
                   right = writer.add_channel("/right/image_raw", kImageType),
                   left_info = writer.add_channel("/left/camera_info", kCameraInfoType),
                   right_info = writer.add_channel("/right/camera_info", kCameraInfoType),
                   other_info = writer.add_channel("/scene/camera_info", kCameraInfoType);
        RosCameraInfo info;
        for (int frame = 0; frame < 3; ++frame) {
            const std::string image =
                image_message(frame * 40 * kMillisecond, {1, 1, "mono8", 1, "x"});
            writer.add(left, image);
            writer.add(right, image);
            info.p[3] = 0;
            info.k[0] = 700;
            writer.add(left_info, camera_info_message(info));
            info.p[3] = changes && frame == 2 ? -3 : -2;
            writer.add(right_info, camera_info_message(info));
            info.k[0] = frame;
            writer.add(other_info, camera_info_message(info));
        }
        BagSource source({folder.write("bag.mcap", writer.finish()), "", ""});
        CameraPair pair;
        while (source.read(pair)) continue;
        CHECK(source.fault() == "");
        if (changes)
            CHECK_SAYS(source.facts().remark(),
                       "The calibration in topic /right/camera_info changes in the recording");
        else
            CHECK(source.facts().remark() == "");
    }
}
