// Bags of ROS 2 in the program: tracked to the same bytes as their images, with their own
// calibration, and refused with their reasons.
#include <doctest/doctest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "sdk/bag/test_bag.hpp"
#include "sdk/cli/commands/test_run.hpp"
#include "sdk/io/calibration.hpp"
#include "sdk/scenes/writing/test_sequence.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 5;
constexpr std::int64_t kStart = 1'700'000'000'123'456'789, kStep = 40'000'000;
using Words = std::vector<std::string>;

const TestFolder& sequence() { return rendered_sequence<kFrames>(); }

Words joined(Words words, const Words& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

int track(const Words& source, const std::string& out) {
    return run(joined({"track", "--quiet", "--no-overlay", "--out", out}, source));
}

Words calibration() { return {"--calibration", sequence() / "calibration.yaml"}; }

nlohmann::json summary_of(const std::string& out) {
    return nlohmann::json::parse(TestFolder::read(out + "/summary.json"));
}

std::string points_of(const std::string& out) { return TestFolder::read(out + "/points.csv"); }

TestImage image_of(const char* view, int frame) {
    const cv::Mat image = cv::imread(
        images_of(sequence() / view)[static_cast<std::size_t>(frame)].string(), cv::IMREAD_COLOR);
    return {static_cast<std::uint32_t>(image.cols),
            static_cast<std::uint32_t>(image.rows),
            "bgr8",
            static_cast<std::uint32_t>(image.cols * 3),
            {reinterpret_cast<const char*>(image.data), image.total() * 3}};
}

// A camera_info of the sequence's own calibration.
std::string info_of(const CameraCalibration& camera, double baseline_mm) {
    constexpr double kMillimetresInMetre = 1000;
    RosCameraInfo info;
    info.width = 320;
    info.height = 240;
    info.distortion_model = "plumb_bob";
    info.k = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
    info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    info.p = {camera.fx, 0,         camera.cx, -camera.fx * baseline_mm / kMillimetresInMetre,
              0,         camera.fy, camera.cy, 0,
              0,         0,         1,         0};
    return camera_info_message(info);
}

struct Bag {
    std::string compression;
    int first = 0, last = kFrames;
    int right_frames = kFrames;  // of the whole sequence
    bool has_info = false;
    double right_late_ms = 0;
    const char* right_name = "/stereo/right/image_raw";

    std::string bytes() const {
        McapWriter::Options options;
        options.compression = compression;
        options.messages = 3;
        McapWriter writer(options);
        const auto left = writer.add_channel("/stereo/left/image_raw", kImageType);
        const auto right = writer.add_channel(right_name, kImageType);
        if (has_info) {
            const StereoCalibration rig = load_calibration(sequence() / "calibration.yaml");
            writer.add(writer.add_channel("/stereo/left/camera_info", kCameraInfoType),
                       info_of(rig.left, 0));
            writer.add(writer.add_channel("/stereo/right/camera_info", kCameraInfoType),
                       info_of(rig.right, -rig.translation[0]));
        }
        for (int frame = first; frame < last; ++frame) {
            const std::int64_t stamp = kStart + frame * kStep;
            writer.add(left, image_message(stamp, image_of("left", frame)));
            if (frame < right_frames)
                writer.add(right,
                           image_message(stamp + static_cast<std::int64_t>(right_late_ms * 1e6),
                                         image_of("right", frame)));
        }
        return writer.finish();
    }
};

// points.csv of the images, at the bag's times.
const std::string& points_of_images() {
    static const TestFolder folder;
    static const std::string points = [] {
        REQUIRE(track(joined({"--left", sequence() / "left", "--right", sequence() / "right",
                              "--fps", "25"},
                             calibration()),
                      folder / "images") == 0);
        return points_of(folder / "images");
    }();
    return points;
}

}  // namespace

TEST_CASE("a bag is tracked to the same bytes as its images, whatever its chunks") {
    const TestFolder folder;
    CHECK(points_of_images().size() > 1000);
    for (const std::string& compression : compressions()) {
        CAPTURE(compression);
        const std::string bag = folder.write("bag.mcap", Bag{compression}.bytes());
        REQUIRE(track(joined({"--bag", bag}, calibration()), folder / "out") == 0);
        CHECK(points_of(folder / "out") == points_of_images());
    }
    const auto summary = summary_of(folder / "out");
    CHECK(summary["input"]["bag"] == folder / "bag.mcap");
    CHECK(summary["input"]["left_topic"] == "/stereo/left/image_raw");
    CHECK(summary["input"]["right_topic"] == "/stereo/right/image_raw");
    CHECK(summary["input"]["fps"] == 25);
    CHECK(summary["bag"]["images_unpaired"] == 0);
    CHECK(summary["cameras"].is_null());
    REQUIRE(run({"track", "--quiet", "--like", folder / "out/summary.json", "--out",
                 folder / "again"}) == 0);
    CHECK(points_of(folder / "again") == points_of_images());
}

TEST_CASE("a folder with a bag in parts, and what `defrec record` makes of it, likewise") {
    const TestFolder folder;
    const std::string bag = folder / "bag";
    fs::create_directory(bag);
    folder.write("bag/rec_0.mcap", Bag{compressions().back(), 0, 2}.bytes());
    folder.write("bag/rec_1.mcap", Bag{"", 2, kFrames}.bytes());
    const Words source = {"--bag",         bag,
                          "--left-topic",  "/stereo/left/image_raw",
                          "--right-topic", "/stereo/right/image_raw"};
    REQUIRE(track(joined(source, calibration()), folder / "out") == 0);
    CHECK(points_of(folder / "out") == points_of_images());
    REQUIRE(run(joined({"record", "--quiet", "--out", folder / "recording"}, source)) == 0);
    REQUIRE(track(joined({"--recording", folder / "recording"}, calibration()),
                  folder / "replayed") == 0);
    CHECK(points_of(folder / "replayed") == points_of_images());
    // A file that is written replaces none of the bag.
    CHECK(track(joined(source, joined({"--trace", bag + "/rec_1.mcap"}, calibration())),
                folder / "traced") == 2);
    CHECK(
        track(joined({"--bag", bag + "/rec_0.mcap", "--trace", bag + "/rec_0.mcap"}, calibration()),
              folder / "traced") == 2);
}

TEST_CASE("a bag's camera_info is its calibration where none is given") {
    const TestFolder folder;
    Bag bag;
    bag.has_info = true;
    const std::string path = folder.write("bag.mcap", bag.bytes());
    REQUIRE(track({"--bag", path}, folder / "out") == 0);
    REQUIRE(track(joined({"--bag", path}, calibration()), folder / "given") == 0);
    const auto of_bag = summary_of(folder / "out"), given = summary_of(folder / "given");
    CHECK(of_bag["input"]["calibration"] == "camera_info of " + path);
    for (const char* number : {"fx", "fy", "cx", "cy", "baseline_mm"})
        CHECK(of_bag["rectified_camera"][number].get<double>() ==
              doctest::Approx(given["rectified_camera"][number].get<double>()));
    CHECK(points_of(folder / "out").size() > 1000);
    const int doctor = run({"doctor", "--quiet", "--bag", path});
    CHECK((doctor == 0 || doctor == 9));
    CHECK(track({"--bag", folder.write("none.mcap", Bag().bytes())}, folder / "none") == 4);
}

TEST_CASE("row 198: a bag that is cut off: exit code 3, and the frames until there") {
    const TestFolder folder;
    const std::string bytes = Bag().bytes();
    const std::string path = folder.write("bag.mcap", bytes.substr(0, bytes.size() * 3 / 4));
    CHECK(track(joined({"--bag", path}, calibration()), folder / "out") == 3);
    const auto summary = summary_of(folder / "out");
    CHECK(summary["frames"] == 3);
    const std::string points = points_of(folder / "out");
    CHECK(points.size() > 1000);
    CHECK(points == points_of_images().substr(0, points.size()));
    CHECK(summary["notes"].dump().find("the file is cut off") != std::string::npos);
}

TEST_CASE("row 199: one view missing, or at other times: exit code 3, with reasons") {
    const TestFolder folder;
    Bag bag;
    bag.right_name = "/stereo/depth";
    CHECK(track(joined({"--bag", folder.write("a.mcap", bag.bytes())}, calibration()),
                folder / "none") == 3);
    bag = {};
    bag.right_late_ms = 100'000;
    CHECK(track(joined({"--bag", folder.write("b.mcap", bag.bytes())}, calibration()),
                folder / "none") == 3);
    CHECK(track(joined({"--bag", folder / "b.mcap", "--left-topic", "/lefd"}, calibration()),
                folder / "none") == 3);
    CHECK_FALSE(fs::exists(folder / "none"));
    // A few images at the end that the recorder caught of one view are no fault, and are told.
    bag = {};
    bag.right_frames = 3;
    CHECK(track(joined({"--bag", folder.write("c.mcap", bag.bytes())}, calibration()),
                folder / "out") == 0);
    const auto summary = summary_of(folder / "out");
    CHECK(summary["frames"] == 3);
    CHECK(summary["bag"]["images_unpaired"] == 2);
    CHECK(summary["notes"].dump().find("2 images of the bag have no partner") != std::string::npos);
}

TEST_CASE("options that contradict each other, or lack a partner: exit code 2") {
    const TestFolder folder;
    const Words images =
        joined({"--left", sequence() / "left", "--right", sequence() / "right"}, calibration());
    CHECK(track(joined({"--bag", "x.mcap"}, images), folder / "out") == 2);
    CHECK(track(joined({"--left-topic", "/a"}, images), folder / "out") == 2);
    CHECK(track(joined({"--bag", "x.mcap", "--fps", "3"}, calibration()), folder / "out") == 2);
    CHECK(track({"--left", sequence() / "left", "--right", sequence() / "right"}, folder / "out") ==
          2);
    CHECK(track(joined({"--bag", folder / "none.mcap"}, calibration()), folder / "out") == 3);
}
