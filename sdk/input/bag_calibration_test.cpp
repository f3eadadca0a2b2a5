// The calibration of a bag by its camera_info.
#include "sdk/input/bag_calibration.hpp"

#include <doctest/doctest.h>

#include "sdk/bag/test_bag.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

// 700 px, 320x240 px, 4.6 mm; rectified images have 680 px.
RosCameraInfo camera(double p3) {
    RosCameraInfo info;
    info.width = 320;
    info.height = 240;
    info.distortion_model = "plumb_bob";
    info.d = {-0.1, 0.02, 0, 0, 0};
    info.k = {700, 0, 160, 0, 701, 120, 0, 0, 1};
    info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    info.p = {680, 0, 155, p3, 0, 680, 118, 0, 0, 0, 1, 0};
    return info;
}

struct Bag {
    RosCameraInfo left = camera(0), right = camera(-680 * 0.0046);
    std::string image = "image_raw";
    bool has_info = true;

    std::string write(const TestFolder& folder) const {
        McapWriter writer;
        const std::string pixels(4, 'x');
        for (const char* view : {"left", "right"})
            writer.add(writer.add_channel("/" + std::string(view) + "/" + image, kImageType),
                       image_message(0, {2, 2, "mono8", 2, pixels}));
        if (has_info) {
            writer.add(writer.add_channel("/left/camera_info", kCameraInfoType),
                       camera_info_message(left));
            writer.add(writer.add_channel("/right/camera_info", kCameraInfoType),
                       camera_info_message(right, ByteWriter::Order::kBig));
        }
        return folder.write("bag.mcap", writer.finish());
    }
};

SourceOptions source_of(const std::string& path) {
    SourceOptions source;
    source.bag.path = path;
    return source;
}

std::string refusal(const SourceOptions& source, LengthUnit unit = LengthUnit::kGuarded) {
    return refusal_of([&] { load_calibration(written_calibration(source, ""), unit); },
                      ExitCode::kCalibration);
}

std::string refusal(const Bag& bag, LengthUnit unit = LengthUnit::kGuarded) {
    const TestFolder folder;
    return refusal(source_of(bag.write(folder)), unit);
}

}  // namespace

TEST_CASE("raw images have K and D, and T from R and P") {
    const TestFolder folder;
    const SourceOptions source = source_of(Bag().write(folder));
    const StereoCalibration found = load_calibration(written_calibration(source, ""));
    CHECK(found.width == 320);
    CHECK(found.height == 240);
    CHECK(found.left.fx == 700);
    CHECK(found.right.fy == 701);
    CHECK(found.left.distortion == std::vector<double>{-0.1, 0.02, 0, 0, 0});
    CHECK(found.translation[0] == doctest::Approx(-4.6));
    CHECK_FALSE(is_rectified(found));
    CHECK(calibration_name(source, "") == "camera_info of " + source.bag.path);
    CHECK(calibration_name(source, "a.yaml") == "a.yaml");
    // Views that are turned: R = R2^T R1.
    Bag turned;
    turned.right.r = {0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8};
    const StereoCalibration rig =
        read_calibration(written_calibration(source_of(turned.write(folder)), ""));
    CHECK(rig.rotation[2] == doctest::Approx(-0.6));
    CHECK(rig.translation[0] == doctest::Approx(-4.6 * 0.8));
}

TEST_CASE("rectified images have P alone") {
    const TestFolder folder;
    Bag bag;
    bag.image = "image_rect_color";
    bag.left.r = bag.right.r = {0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8};
    const StereoCalibration found =
        load_calibration(written_calibration(source_of(bag.write(folder)), ""));
    CHECK(found.left.fx == 680);
    CHECK(found.left.cx == 155);
    CHECK(found.left.distortion.empty());
    CHECK(is_rectified(found));
}

TEST_CASE("images that hold both views have no camera_info of their own") {
    const TestFolder folder;
    SourceOptions source = source_of(Bag().write(folder));
    source.bag.has_stereo_images = true;
    source.bag.stereo_topic = "/left/image_raw";
    const std::string message = refusal(source);
    CHECK_SAYS(message, "each image of topic /left/image_raw holds both views");
    CHECK_SAYS(message, "Give the calibration with --calibration.");
}

TEST_CASE("a camera_info that is missing, not complete or not plausible is refused") {
    Bag bag;
    bag.has_info = false;
    CHECK_SAYS(refusal(bag), "/left/camera_info of type sensor_msgs/msg/CameraInfo was expected");
    CHECK_SAYS(refusal(bag), "with --calibration");
    bag = {};
    bag.left.k = {};
    CHECK_SAYS(refusal(bag),
               "/left/camera_info: it is of a camera that was not calibrated: K is 0");
    bag = {};
    bag.right.p = {};
    CHECK_SAYS(refusal(bag), "/right/camera_info: it is of a camera that was not calibrated: P");
    bag = {};
    bag.right.p[3] = 0;
    CHECK_SAYS(refusal(bag), "the baseline is zero");
    bag = {};
    std::swap(bag.left.p, bag.right.p);
    CHECK_SAYS(refusal(bag), "the cameras are exchanged");
    bag = {};
    bag.left.binning_x = 2;
    CHECK_SAYS(refusal(bag), "binned");
    bag = {};
    bag.left.roi_width = 100;
    CHECK_SAYS(refusal(bag), "a part of the sensor's");
    bag = {};
    bag.left.d.pop_back();
    bag.left.d.pop_back();
    CHECK_SAYS(refusal(bag), ".D: the distortion has 3 coefficients");
    bag = {};
    bag.left.distortion_model = "equidistant";
    CHECK_SAYS(refusal(bag), "'equidistant' is not supported");
    bag = {};
    bag.right.width = 640;
    CHECK_SAYS(refusal(bag), "different image sizes");
    bag = {};
    bag.left.r[0] = 2;
    CHECK_SAYS(refusal(bag), "R is not a rotation");
    bag = {};
    bag.left.k[1] = 3;
    CHECK_SAYS(refusal(bag), "skew");
    bag = {};
    bag.right.p[3] = -680 * 4.6;
    CHECK_SAYS(refusal(bag), "--units mm");
    CHECK(refusal(bag, LengthUnit::kMillimetre) == "accepted");
}
