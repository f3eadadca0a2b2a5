// Heart phantom: which map belongs to a frame, rendered data in, malformed copies.
#include "sdk/evaluation/data_sets/heart_phantom.hpp"

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "sdk/evaluation/layout_test.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 3;

void write_video(const fs::path& images, const fs::path& to) {
    cv::VideoWriter video;
    for (int frame = 0; frame < kFrames; ++frame) {
        const cv::Mat image =
            cv::imread((images / ("000000000" + std::to_string(frame) + ".jpg")).string());
        if (frame == 0)
            REQUIRE(video.open(to.string(), cv::CAP_FFMPEG,
                               cv::VideoWriter::fourcc('m', 'p', '4', 'v'), kHeartPhantomVideoFps,
                               image.size()));
        video.write(image);
    }
}

void write_map(const cv::Mat& depth, const fs::path& to) {
    std::ofstream file(to);
    for (int v = 0; v < depth.rows; ++v)
        for (int u = 0; u < depth.cols; ++u)
            file << "0.5 -0.5 " << depth.at<std::uint16_t>(v, u) << "\n";
}

// A rendered scene; maps of no frame have the first frame's depth and 40 mm more.
const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made = [] {
        const TestFolder rendered;
        render_layout_to(rendered.path(), "heartbeat", "hamlyn", kFrames);
        const fs::path from = rendered.path() / "rectified01", to = folder.path() / "f7";
        fs::create_directories(to);
        write_video(from / "color", to / "f7_dynamic_deint_L.avi");
        write_video(from / "image02", to / "f7_dynamic_deint_R.avi");
        std::vector<cv::Mat> maps(kHeartPhantomMaps);
        for (int frame = kFrames - 1; frame >= 0; --frame) {
            const cv::Mat depth = cv::imread(
                (from / "depth" / ("000000000" + std::to_string(frame) + ".png")).string(),
                cv::IMREAD_UNCHANGED);
            if (frame == 0)
                for (cv::Mat& map : maps)
                    if (map.empty()) map = depth + 40;
            maps[static_cast<size_t>(heart_phantom_map(frame, kHeartPhantomPhase))] = depth;
        }
        for (int map = 0; map < kHeartPhantomMaps; ++map)
            write_map(maps[static_cast<size_t>(map)],
                      to / ("heartDepthMap_" + std::to_string(map) + ".txt"));
        const TestFolder usual;
        RenderOptions options;
        options.scene = "heartbeat";
        options.out_dir = usual.path().string();
        options.width = 320;
        options.height = 240;
        options.frames = 1;
        render_sequence(options, {});
        fs::copy(usual.path() / "calibration.yaml", to);
        return true;
    }();
    static_cast<void>(is_made);
    return folder;
}

}  // namespace

TEST_CASE("maps follow each other 30 a second, frames 25") {
    CHECK(heart_phantom_map(0, 0) == 0);
    CHECK(heart_phantom_map(0, kHeartPhantomPhase) == 2);
    CHECK(heart_phantom_map(1, kHeartPhantomPhase) == 3);
    CHECK(heart_phantom_map(2, kHeartPhantomPhase) == 5);
    CHECK(heart_phantom_map(15, kHeartPhantomPhase) == 0);  // 20.8
    CHECK(heart_phantom_map(5000, 0) == 0);
}

TEST_CASE("the truth of a frame is the map of its time") {
    const TestFolder out, late;
    REQUIRE(evaluate_set("heart-phantom", data_set().path(), out.path()) == 0);
    const double error = result_of(out.path(), "f7", "mean_abs_mm");
    CHECK(error < 2);  // maps are in whole mm here
    CHECK(result_of(out.path(), "f7", "rms_mm") >= error);
    CHECK(result_of(out.path(), "f7", "found_share") > 0.5);

    const TestFolder root;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    std::ofstream(root.path() / "f7/phase.txt") << "0.4\n";  // no frame's map
    REQUIRE(evaluate_set("heart-phantom", root.path(), late.path()) == 0);
    CHECK(result_of(late.path(), "f7", "mean_abs_mm") > 35);
}

TEST_CASE("what is not as expected is named") {
    BrokenCopies copies(data_set().path() / "f7");
    fs::remove(copies.copy("no_right") / "f7_dynamic_deint_R.avi");
    fs::copy(data_set().path() / "f7/f7_dynamic_deint_L.avi", copies.copy("two_left") / "f5_L.avi");
    fs::remove(copies.copy("no_calibration") / "calibration.yaml");
    fs::remove(copies.copy("no_map") / "heartDepthMap_7.txt");
    std::ofstream(copies.copy("words") / "heartDepthMap_3.txt") << "1 2 far\n";
    std::ofstream(copies.copy("short") / "heartDepthMap_3.txt") << "1 2 3\n";
    std::ofstream(copies.copy("long") / "heartDepthMap_3.txt", std::ios::app) << "1 2 3\n";
    std::ofstream(copies.copy("early") / "phase.txt") << "-1\n";
    copies.evaluate("heart-phantom");
    copies.says("no_right", "one video *R.avi or *R.mp4 was expected here; there are 0");
    copies.says("two_left", "there are 2");
    copies.says("no_calibration", "calibration.yaml: this file was expected");
    copies.says("no_map", "heartDepthMap_7.txt");
    copies.says("words", "heartDepthMap_3.txt:1: a line \"x y z\"");
    copies.says("short", "76800 lines were expected; one for each pixel; there are 1");
    copies.says("long", "heartDepthMap_3.txt:76801: a line \"x y z\"");
    copies.says("early", "phase.txt: seconds");
}
