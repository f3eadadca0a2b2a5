// SCARED: metrics by hand, rendered data in, malformed copies.
#include <cmath>
#include <cstring>
#include <opencv2/imgcodecs.hpp>

#include "sdk/evaluation/clip_store.hpp"
#include "sdk/evaluation/data_sets/depth_meter.hpp"
#include "sdk/evaluation/program_run.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/scenes/writing/render_command.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kWidth = 320, kHeight = 240, kFrames = 3;
const char* const kKeyframe = "dataset_1/keyframe_1";

void render(const fs::path& to, const std::string& scene, const std::string& layout) {
    RenderOptions options;
    options.scene = scene;
    options.out_dir = to.string();
    options.width = kWidth;
    options.height = kHeight;
    options.frames = kFrames;
    options.layout = layout;
    options.depth = layout == "defrec";
    render_sequence(options, {});
}

const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made = (render(folder.path(), "heartbeat", "scared"), true);
    static_cast<void>(is_made);
    return folder;
}

int evaluate(const fs::path& root, const fs::path& out, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"--dataset",  "scared",    root.string(), "--out",
                                       out.string(), "--backend", "cpu",         "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_evaluate_program(arguments);
}

// z of an image of x, y, z, whose channels OpenCV gives in reverse.
float true_depth(const cv::Mat& points, int v, int u) { return points.at<cv::Vec3f>(v, u)[0]; }

// The mean distance of what was found from the truth, worked out anew.
double mean_error(const cv::Mat& points, const cv::Mat& depth) {
    double sum = 0;
    int count = 0;
    for (int v = 0; v < kHeight; ++v) {
        for (int u = 0; u < kWidth; ++u) {
            const float z = true_depth(points, v, u), found = depth.at<float>(v, u);
            if (std::isnan(z) || z == 0 || found == 0) continue;
            sum += std::abs(z - found);
            ++count;
        }
    }
    return sum / count;
}

}  // namespace

TEST_CASE("errors of depth by hand: what is unknown on either side does not count") {
    const float inf = INFINITY;
    const cv::Mat truth = (cv::Mat_<float>(2, 4) << 10, 20, 30, 0, float(kNone), -1, inf, 50);
    const cv::Mat depth = (cv::Mat_<float>(2, 4) << 11, 18, 0, 40, 40, 40, 40, 54);
    const DepthErrors errors = errors_of(truth, depth);
    CHECK(errors.truth_share == 0.5);
    CHECK(errors.found_share == 0.75);
    CHECK(errors.mean_abs_mm == doctest::Approx(7.0 / 3));
    CHECK(errors.median_abs_mm == 2);
    const DepthErrors none = errors_of(truth, cv::Mat(2, 4, CV_32F, cv::Scalar(0)));
    CHECK(none.found_share == 0);
    CHECK(std::isnan(none.mean_abs_mm));
}

TEST_CASE("frames with truth in less than a tenth of the image do not count") {
    const DataSet& scared = data_set_of("scared");
    Samples samples(scared.sample_columns());
    samples.add({0, 0.5, 0.8, 2, 1});
    samples.add({1, 0.1, 0.4, 4, 2});
    samples.add({2, 0.09, 1, 100, 100});
    samples.add({3, 0.5, 0, kNone, kNone});  // nothing was found
    const std::vector<double> metrics = scared.summarise(samples);
    CHECK(metrics[0] == 3);
    CHECK(metrics[1] == 1.5);
    CHECK(metrics[2] == doctest::Approx(0.4));
    CHECK(metrics[3] == 3);
    CHECK(std::isnan(scared.summarise(Samples(scared.sample_columns()))[0]));
}

TEST_CASE("rendered truth is that of the rendered disparity, x y z in the file's order") {
    const TestFolder plain;
    render(plain.path(), "heartbeat", "defrec");
    const fs::path keyframe = data_set().path() / kKeyframe;
    const cv::Mat points = cv::imread(
        (keyframe / "data/scene_points/scene_points000002.tiff").string(), cv::IMREAD_UNCHANGED);
    const cv::Mat disparity = cv::imread(plain / "disparity/000002.png", cv::IMREAD_UNCHANGED);
    REQUIRE(points.size() == cv::Size(kWidth, 2 * kHeight));
    cv::FileStorage calibration((keyframe / "endoscope_calibration.yaml").string(),
                                cv::FileStorage::READ);
    cv::Mat m1, t;
    calibration["M1"] >> m1;
    calibration["T"] >> t;
    CHECK(calibration["image_width"].empty());
    const double scale = -m1.at<double>(0, 0) * t.at<double>(0);
    int compared = 0;
    for (int v = 0; v < kHeight; ++v) {
        for (int u = 0; u < kWidth; ++u) {
            const double d = disparity.at<std::uint16_t>(v, u) / 256.0;
            if (d == 0) continue;
            ++compared;
            REQUIRE(scale / true_depth(points, v, u) == doctest::Approx(d).epsilon(0.001));
        }
    }
    CHECK(compared > kWidth * kHeight / 2);
    // The file is not compressed: after 8 bytes of header come the floats of the first pixel.
    const std::string bytes = TestFolder::read(keyframe / "left_depth_map.tiff");
    float xyz[3];
    std::memcpy(xyz, bytes.data() + 8, sizeof xyz);
    CHECK(xyz[0] < 0);  // left of the axis and above it
    CHECK(xyz[1] < 0);
    CHECK(xyz[2] > 50);
    CHECK(xyz[0] / xyz[2] == doctest::Approx(-m1.at<double>(0, 2) / m1.at<double>(0, 0)));
}

TEST_CASE("rendered data in, and the score is that of the depth maps that were written") {
    const TestFolder out;
    REQUIRE(evaluate(data_set().path(), out.path()) == 0);
    const fs::path keyframe = data_set().path() / kKeyframe;
    const auto check = [&](const std::string& clip, const char* truth_format, int frames) {
        const fs::path folder = ClipStore(out.path()).folder({"defrec", clip});
        CsvReader samples(folder / "samples.csv",
                          {"frame", "truth_share", "found_share", "mean_abs_mm"});
        for (int frame = 0; frame < frames; ++frame) {
            REQUIRE(samples.next());
            CHECK(samples.integer(0) == frame);
            const cv::Mat truth = cv::imread((keyframe / cv::format(truth_format, frame)).string(),
                                             cv::IMREAD_UNCHANGED);
            const cv::Mat depth = cv::imread(
                (folder / cv::format("depth/%06d.tiff", frame)).string(), cv::IMREAD_UNCHANGED);
            CHECK(samples.number(1) > 0.5);
            CHECK(samples.number(2) > 0.6);
            CHECK(samples.number(3) == doctest::Approx(mean_error(truth, depth)));
            CHECK(samples.number(3) < 1.5);  // the video is compressed
        }
        CHECK_FALSE(samples.next());
    };
    check(kKeyframe, "left_depth_map.tiff", 1);
    check(std::string(kKeyframe) + "/data", "data/scene_points/scene_points%06d.tiff", kFrames);
}

TEST_CASE("depth is that of the left camera as given, not of the rectified one") {
    const TestFolder root, out;
    render(root.path(), "respiration", "scared");
    REQUIRE(evaluate(root.path(), out.path(), {"--subset", kKeyframe}) == 0);
    CsvReader results(out.path() / "results.csv", {"mean_abs_mm", "found_share"});
    REQUIRE(results.next());
    CHECK(results.number(0) < 1);
    CHECK(results.number(1) > 0.6);
}

TEST_CASE("perturbed truth changes the score by as much") {
    const TestFolder root, out;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    const std::string file = root / (std::string(kKeyframe) + "/left_depth_map.tiff");
    cv::Mat points = cv::imread(file, cv::IMREAD_UNCHANGED);
    constexpr float kShift = 50;  // more than any error
    for (int v = 0; v < kHeight; ++v)
        for (int u = 0; u < kWidth; ++u) points.at<cv::Vec3f>(v, u)[0] += kShift;
    cv::imwrite(file, points);
    REQUIRE(evaluate(root.path(), out.path(), {"--subset", kKeyframe}) == 0);
    CsvReader results(out.path() / "results.csv", {"mean_abs_mm", "median_abs_mm"});
    REQUIRE(results.next());
    CHECK(results.number(0) == doctest::Approx(kShift).epsilon(0.02));
    CHECK(results.number(1) == doctest::Approx(kShift).epsilon(0.02));
}

TEST_CASE("scenes and sizes that a layout cannot take are refused before anything is written") {
    const TestFolder folder;
    const auto refusal = [&](const std::string& scene, const std::string& layout, int width,
                             bool depth = false) -> std::string {
        RenderOptions options;
        options.scene = scene;
        options.out_dir = folder / "out";
        options.width = width;
        options.height = kHeight;
        options.frames = 1;
        options.layout = layout;
        options.depth = depth;
        try {
            render_sequence(options, {});
        } catch (const RenderUsageError& error) {
            return error.what();
        }
        return "accepted";
    };
    CHECK(refusal("heartbeat", "kitti", kWidth).find("no layout 'kitti'") != std::string::npos);
    CHECK(refusal("heartbeat", "scared", kWidth + 1).find("even size") != std::string::npos);
    CHECK(refusal("respiration", "serv-ct", kWidth).find("raw images") != std::string::npos);
    CHECK(refusal("compressed", "serv-ct", kWidth).find("compressed") != std::string::npos);
    CHECK(refusal("heartbeat", "serv-ct", kWidth, true).find("--depth") != std::string::npos);
    CHECK_FALSE(fs::exists(folder / "out"));
}

TEST_CASE("what is not as expected is named") {
    const TestFolder root;
    const auto copy = [&](const char* name) {
        const fs::path to = root.path() / name;
        fs::create_directories(to);
        fs::copy(data_set().path() / kKeyframe, to, fs::copy_options::recursive);
        return to;
    };
    fs::remove(copy("no_map") / "left_depth_map.tiff");
    fs::copy_file(data_set().path() / kKeyframe / "Left_Image.png",
                  copy("a_picture") / "left_depth_map.tiff", fs::copy_options::overwrite_existing);
    fs::rename(copy("packed") / "data/scene_points", root / "packed/data/scene_points.tar.gz");
    const fs::path points = copy("unnumbered") / "data/scene_points";
    fs::rename(points / "scene_points000001.tiff", points / "scene_points.tiff");
    std::ofstream(copy("cut") / "Right_Image.png") << "not an image";
    std::ofstream(copy("uncalibrated") / "endoscope_calibration.yaml") << "M1: 1\n";
    const TestFolder out;
    REQUIRE(evaluate(root.path(), out.path(), {"--jobs", "2"}) == 6);
    auto reasons = reasons_of(out.path());
    const auto says = [&](const char* clip, const char* text) {
        INFO(clip << ": " << reasons[clip]);
        CHECK(reasons[clip].find(text) != std::string::npos);
    };
    says("no_map", "left_depth_map.tiff: this file was expected: x; y; z in mm");
    says("a_picture", "an image of three floats for each pixel; 320x240; was expected");
    says("packed/data", "what scene_points.tar.gz holds; unpacked");
    says("unnumbered/data", "scene_points.tiff: a name with the number of a frame");
    says("cut", "Right_Image.png: this is not a whole image");
    says("uncalibrated", "endoscope_calibration.yaml:1");
    CHECK(reasons.at("packed").empty());
}
