// Bags of ROS 2 in the program: tracked to the same bytes as their images, with their own
// calibration, and refused with their reasons.
#include <doctest/doctest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "sdk/bag/test_bag.hpp"
#ifdef DEFREC_WITH_SQLITE
#include "sdk/bag/test_sqlite_bag.hpp"
#endif
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

cv::Mat view_of(const char* view, int frame) {
    return cv::imread(images_of(sequence() / view)[static_cast<std::size_t>(frame)].string(),
                      cv::IMREAD_COLOR);
}

TestImage image_of(const cv::Mat& image) {
    return {static_cast<std::uint32_t>(image.cols),
            static_cast<std::uint32_t>(image.rows),
            "bgr8",
            static_cast<std::uint32_t>(image.cols * 3),
            {reinterpret_cast<const char*>(image.data), image.total() * 3}};
}

TestImage image_of(const char* view, int frame) { return image_of(view_of(view, frame)); }

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
        fill(
            [&](const char* name, std::string_view type) { return writer.add_channel(name, type); },
            [&](std::uint16_t topic, const std::string& data) { writer.add(topic, data); });
        return writer.finish();
    }

#ifdef DEFREC_WITH_SQLITE
    void write_sqlite(const std::string& path) const {
        SqliteBag writer(path);
        fill([&](const char* name, std::string_view type) { return writer.add_topic(name, type); },
             [&](int topic, const std::string& data) { writer.add(topic, 0, data); });
    }
#endif

  private:
    template <class AddTopic, class Add>
    void fill(const AddTopic& add_topic, const Add& add) const {
        const auto left = add_topic("/stereo/left/image_raw", kImageType);
        const auto right = add_topic(right_name, kImageType);
        if (has_info) {
            const StereoCalibration rig = load_calibration(sequence() / "calibration.yaml");
            add(add_topic("/stereo/left/camera_info", kCameraInfoType), info_of(rig.left, 0));
            add(add_topic("/stereo/right/camera_info", kCameraInfoType),
                info_of(rig.right, -rig.translation[0]));
        }
        for (int frame = first; frame < last; ++frame) {
            const std::int64_t stamp = kStart + frame * kStep;
            add(left, image_message(stamp, image_of("left", frame)));
            if (frame < right_frames)
                add(right, image_message(stamp + static_cast<std::int64_t>(right_late_ms * 1e6),
                                         image_of("right", frame)));
        }
    }
};

// Both views in each image of one topic.
std::string bag_of_both(bool is_wide) {
    McapWriter writer;
    const auto topic = writer.add_channel("/stereo/image_raw", kImageType);
    for (int frame = 0; frame < kFrames; ++frame) {
        const cv::Mat views[] = {view_of("left", frame), view_of("right", frame)};
        cv::Mat both;
        if (is_wide)
            cv::hconcat(views, 2, both);
        else
            cv::vconcat(views, 2, both);
        writer.add(topic, image_message(kStart + frame * kStep, image_of(both)));
    }
    return writer.finish();
}

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

#ifdef DEFREC_WITH_SQLITE
TEST_CASE("a bag in SQLite is tracked to the same bytes as its images") {
    const TestFolder folder;
    Bag bag;
    bag.has_info = true;
    bag.write_sqlite(folder / "bag.db3");
    REQUIRE(track(joined({"--bag", folder / "bag.db3"}, calibration()), folder / "out") == 0);
    CHECK(points_of(folder / "out") == points_of_images());
    const auto summary = summary_of(folder / "out");
    CHECK(summary["input"]["bag"] == folder / "bag.db3");
    CHECK(summary["input"]["left_topic"] == "/stereo/left/image_raw");
    CHECK(summary["bag"]["images_unpaired"] == 0);
    // In parts, and with its own calibration.
    fs::create_directory(folder / "parts");
    bag.last = 2;
    bag.write_sqlite(folder / "parts/rec_0.db3");
    bag.first = 2;
    bag.last = kFrames;
    bag.write_sqlite(folder / "parts/rec_1.db3");
    REQUIRE(track(joined({"--bag", folder / "parts"}, calibration()), folder / "parts_out") == 0);
    CHECK(points_of(folder / "parts_out") == points_of_images());
    REQUIRE(track({"--bag", folder / "parts"}, folder / "own") == 0);
    CHECK(summary_of(folder / "own")["input"]["calibration"] ==
          "camera_info of " + (folder / "parts"));
}

TEST_CASE("row 210: an SQLite bag that is damaged: exit code 3, and the frames until there") {
    const TestFolder folder;
    Bag().write_sqlite(folder / "whole.db3");
    std::string bytes = TestFolder::read(folder / "whole.db3");
    // Pages of a long message begin with the number of the next one.
    constexpr std::size_t kPage = 4096;
    const std::size_t page = bytes.size() * 3 / 4 / kPage * kPage;
    bytes.replace(page, 4, "\xff\xff\xff\xff");
    const std::string path = folder.write("bag.db3", bytes);
    CHECK(track(joined({"--bag", path}, calibration()), folder / "out") == 3);
    const auto summary = summary_of(folder / "out");
    CHECK(summary["frames"] == 3);
    const std::string points = points_of(folder / "out");
    CHECK(points == points_of_images().substr(0, points.size()));
    CHECK(summary["notes"].dump().find("SQLite says database disk image is malformed") !=
          std::string::npos);
    CHECK(track(joined({"--bag", folder.write("text.db3", "no database at all")}, calibration()),
                folder / "none") == 3);
    CHECK_FALSE(fs::exists(folder / "none"));
}
#endif

TEST_CASE("both views in one topic are tracked to the same bytes as their images") {
    const TestFolder folder;
    for (const bool is_wide : {true, false}) {
        CAPTURE(is_wide);
        const char* layout = is_wide ? "side-by-side" : "top-bottom";
        const std::string bag = folder.write("bag.mcap", bag_of_both(is_wide));
        REQUIRE(track(joined({"--bag", bag, "--layout", layout}, calibration()), folder / "out") ==
                0);
        CHECK(points_of(folder / "out") == points_of_images());
        const auto input = summary_of(folder / "out")["input"];
        CHECK(input["bag"] == bag);
        CHECK(input["stereo_topic"] == "/stereo/image_raw");
        CHECK(input["layout"] == layout);
        CHECK_FALSE(input.contains("left_topic"));
        REQUIRE(run({"track", "--quiet", "--like", folder / "out/summary.json", "--out",
                     folder / "again"}) == 0);
        CHECK(points_of(folder / "again") == points_of_images());
    }
    const Words source = {"--bag",    folder / "bag.mcap", "--stereo-topic", "/stereo/image_raw",
                          "--layout", "top-bottom"};
    REQUIRE(run(joined({"record", "--quiet", "--out", folder / "recording"}, source)) == 0);
    REQUIRE(track(joined({"--recording", folder / "recording"}, calibration()),
                  folder / "replayed") == 0);
    CHECK(points_of(folder / "replayed") == points_of_images());
    const int doctor = run(joined(joined({"doctor", "--quiet"}, source), calibration()));
    CHECK((doctor == 0 || doctor == 9));
}

TEST_CASE("row 199: a topic with both views, and what contradicts it: exit codes 2, 3 and 4") {
    const TestFolder folder;
    const std::string both = folder.write("both.mcap", bag_of_both(true)),
                      two = folder.write("two.mcap", Bag().bytes()), out = folder / "none";
    const Words wide = {"--layout", "side-by-side"};
    const auto tracked = [&](const std::string& bag, const Words& options) {
        return track(joined(joined({"--bag", bag}, options), calibration()), out);
    };
    // Not said, and said of views that each have a topic.
    CHECK(tracked(both, {}) == 3);
    CHECK(tracked(two, wide) == 3);
    CHECK(tracked(both, joined({"--stereo-topic", "/stereo"}, wide)) == 3);
    // The wrong way: the calibration is of another size.
    CHECK(tracked(both, {"--layout", "top-bottom"}) == 4);
    CHECK(track(joined({"--bag", both}, wide), out) == 4);
    CHECK(tracked(both, {"--stereo-topic", "/stereo/image_raw"}) == 2);
    CHECK(tracked(two, joined({"--left-topic", "/stereo/left/image_raw"}, wide)) == 2);
    CHECK(tracked(both, joined({"--stereo-topic", "/stereo/image_raw", "--right-topic", "/r"},
                               wide)) == 2);
    CHECK(tracked(both, {"--layout", "beside"}) == 2);
    const Words images =
        joined({"--left", sequence() / "left", "--right", sequence() / "right"}, calibration());
    CHECK(track(joined(wide, images), out) == 2);
    CHECK(track(joined({"--stereo-topic", "/a"}, images), out) == 2);
    CHECK_FALSE(fs::exists(out));
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
