// Which topics are the two views.
#include "sdk/bag/stereo_topics.hpp"

#include <doctest/doctest.h>

#include "sdk/bag/ros_messages.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

BagTopic image(const char* name, std::uint64_t messages = 10, std::string_view type = kImageType) {
    return {name, std::string(type), "cdr", messages};
}

std::string refusal(const std::vector<BagTopic>& topics, const std::string& left = {},
                    const std::string& right = {}) {
    return refusal_of([&] { choose_topics("bag.mcap", topics, left, right); });
}

const BagTopic kInfo{"/stereo/left/camera_info", std::string(kCameraInfoType), "cdr", 10};

}  // namespace

TEST_CASE("the one pair that differs by left and right is taken") {
    const StereoTopics found =
        choose_topics("bag.mcap",
                      {kInfo, image("/stereo/right/image_raw"), image("/scene/image"),
                       image("/stereo/left/image_raw")},
                      "", "");
    CHECK(found.left.name == "/stereo/left/image_raw");
    CHECK(found.right->name == "/stereo/right/image_raw");
    const StereoTopics repeated = choose_topics(
        "bag.mcap", {image("/left_cam/image_left"), image("/right_cam/image_right")}, "", "");
    CHECK(repeated.right->name == "/right_cam/image_right");
    CHECK(choose_topics("bag.mcap", {image("/left/a"), image("/right/a"), image("/left/b")},
                        "/left/b", "/right/a")
              .left.name == "/left/b");
}

TEST_CASE("one name is enough where the other follows from it") {
    const std::vector<BagTopic> topics = {image("/left/a"), image("/right/a"), image("/left/b"),
                                          image("/right/b"), image("/left/c")};
    CHECK(choose_topics("bag.mcap", topics, "/left/b", "").right->name == "/right/b");
    CHECK(choose_topics("bag.mcap", topics, "", "/right/b").left.name == "/left/b");
    CHECK_SAYS(refusal(topics, "/left/c"), "give --right-topic as well");
}

TEST_CASE("row 199: one view alone, none, or doubt is refused with what images there are") {
    const std::string several =
        refusal({image("/left/a"), image("/right/a"), image("/left/b"), image("/right/b")});
    CHECK_SAYS(several, "several pairs of topics");
    CHECK_SAYS(several, "/left/a (sensor_msgs/msg/Image, 10), /right/a");
    const std::string lonely = refusal({kInfo, image("/stereo/left/image_raw")});
    CHECK_SAYS(lonely, "no two topics of images are told");
    CHECK_SAYS(lonely, "topics of images: /stereo/left/image_raw (sensor_msgs/msg/Image, 10).");
    CHECK_SAYS(refusal({kInfo}), "It has no topic of images.");
    CHECK_SAYS(refusal({image("/left/a"), image("/right/a", 0)}), "no two topics");
    // The views are of one type.
    CHECK_SAYS(refusal({image("/left/a"), image("/right/a", 10, kCompressedImageType)}),
               "no two topics");
}

TEST_CASE("row 199: names that are of no images are refused") {
    const std::vector<BagTopic> topics = {
        kInfo, image("/left/a"), image("/right/a", 0), {"/raw", "sensor_msgs/Image", "ros1", 3}};
    CHECK_SAYS(refusal(topics, "/lefd/a", "/right/a"), "there is no topic '/lefd/a'");
    CHECK_SAYS(refusal(topics, "/left/a", kInfo.name),
               "has the type 'sensor_msgs/msg/CameraInfo' in 'cdr'");
    CHECK_SAYS(refusal(topics, "", kInfo.name), "has the type 'sensor_msgs/msg/CameraInfo'");
    CHECK_SAYS(refusal(topics, "/left/a", "/raw"), "'sensor_msgs/Image' in 'ros1'");
    CHECK_SAYS(refusal(topics, "/left/a", "/raw"), "/raw (sensor_msgs/Image in ros1, 3)");
    CHECK_SAYS(refusal(topics, "/left/a", "/right/a"), "'/right/a' has no message");
    CHECK_SAYS(refusal(topics, "/left/a", "/left/a"), "cannot be both views");
}

TEST_CASE("row 199: both views in one topic: the one that is named, or the only one of images") {
    const auto chosen = [](const std::vector<BagTopic>& topics, const std::string& name) {
        const StereoTopics views = choose_stereo_topic("bag.mcap", topics, name);
        CHECK_FALSE(views.right);
        return views.left.name;
    };
    const BagTopic both = image("/stereo/image_raw"), scene = image("/scene/image");
    CHECK(chosen({kInfo, both, image("/empty", 0)}, "") == both.name);
    CHECK(chosen({scene, both}, both.name) == both.name);
    const auto refused = [&](const std::vector<BagTopic>& topics, const std::string& name) {
        return refusal_of([&] { chosen(topics, name); });
    };
    CHECK_SAYS(refused({scene, both}, ""), "several topics have images");
    CHECK_SAYS(refused({scene, both}, ""), "with --stereo-topic");
    CHECK_SAYS(refused({scene, both}, ""), "/scene/image (sensor_msgs/msg/Image, 10), /stereo/");
    CHECK_SAYS(refused({kInfo}, ""), "no topic has images that could hold both views");
    CHECK_SAYS(refused({both}, "/stereo"), "there is no topic '/stereo'");
    CHECK_SAYS(refused({kInfo, both}, kInfo.name), "has the type 'sensor_msgs/msg/CameraInfo'");
    // Without a layout.
    CHECK_SAYS(refusal({kInfo, both}), "say with --layout how the images of one topic hold both");
}

TEST_CASE("camera_info lies beside the image, and names say what is rectified") {
    CHECK(camera_info_topic("/stereo/left/image_raw") == "/stereo/left/camera_info");
    CHECK(camera_info_topic("/stereo/left/image_raw/compressed") == "/stereo/left/camera_info");
    CHECK(camera_info_topic("image") == "camera_info");
    CHECK_FALSE(is_rectified_topic("/stereo/left/image_raw"));
    CHECK_FALSE(is_rectified_topic("/correct/left/image"));
    CHECK(is_rectified_topic("/stereo/left/image_rect"));
    CHECK(is_rectified_topic("/stereo/left/image_rect_color/compressed"));
    CHECK(is_rectified_topic("/zed/left/color/rect/image"));
}
