// SERV-CT: metrics by hand, rendered data in, malformed copies.
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "sdk/evaluation/clip_store.hpp"
#include "sdk/evaluation/data_sets/serv_ct_errors.hpp"
#include "sdk/evaluation/program_run.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/scenes/writing/render_command.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kWidth = 320, kHeight = 240;

const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made = [] {
        RenderOptions options;
        options.scene = "indentation";
        options.out_dir = folder.path().string();
        options.width = kWidth;
        options.height = kHeight;
        options.frames = 2;
        options.layout = "serv-ct";
        render_sequence(options, {});
        return true;
    }();
    static_cast<void>(is_made);
    return folder;
}

int evaluate(const fs::path& root, const fs::path& out) {
    return run_evaluate_program({"--dataset", "serv-ct", root.string(), "--out", out.string(),
                                 "--backend", "cpu", "--quiet", "--jobs", "2"});
}

cv::Mat read(const fs::path& path) { return cv::imread(path.string(), cv::IMREAD_UNCHANGED); }

}  // namespace

TEST_CASE("errors by hand, of all pixels with truth and without occluded ones") {
    const cv::Vec3b black(0, 0, 0), blue(255, 0, 0), yellow(0, 255, 255), red(0, 0, 255),
        green(0, 255, 0);
    ServCtImage image;
    // f B = 1000, offset 2: disparities 12, 22, 52, 12, 27, 12, 12.
    image.depth = (cv::Mat_<float>(1, 7) << 100, 50, 20, 100, 40, 100, 0);
    image.true_depth = (cv::Mat_<float>(1, 7) << 101, 52, 20, 100, 40, 0, 100);
    image.true_disparity = (cv::Mat_<float>(1, 7) << 11, 26, 52, 12, 27, 12, 12);
    image.occlusion = (cv::Mat_<cv::Vec3b>(1, 7) << black, yellow, red, blue, green, black, black);
    image.focal_baseline = 1000;
    image.disparity_offset = 2;
    // Pixels 0, 1, 2 and 4; 6 has truth, and nothing was found.
    const ServCtErrors all = errors_of(image, false);
    CHECK(all.found_share == doctest::Approx(0.8));
    CHECK(all.epe_px == doctest::Approx(5.0 / 4));
    CHECK(all.rms_px == doctest::Approx(std::sqrt(17.0 / 4)));
    CHECK(all.bad3_share == doctest::Approx(0.25));
    CHECK(all.mae_mm == doctest::Approx(0.75));
    CHECK(all.rms_mm == doctest::Approx(std::sqrt(5.0 / 4)));
    CHECK(all.median_mm == doctest::Approx(0.5));
    const ServCtErrors visible = errors_of(image, true);
    CHECK(visible.found_share == doctest::Approx(0.5));
    CHECK(visible.epe_px == doctest::Approx(1));
    CHECK(visible.mae_mm == doctest::Approx(1));
    CHECK(visible.bad3_share == 0);
    image.depth.setTo(0);
    CHECK(std::isnan(errors_of(image, false).epe_px));
    CHECK(errors_of(image, false).found_share == 0);
}

TEST_CASE("rendered data in, and the score is that of the depth maps that were written") {
    const TestFolder out;
    REQUIRE(evaluate(data_set().path(), out.path()) == 0);
    const fs::path truth = data_set().path() / "Experiment_1/Ground_truth_CT";
    const fs::path clip = ClipStore(out.path()).folder({"defrec", "Experiment_1"});
    CsvReader samples(clip / "samples.csv", {"image", "epe_px", "mae_mm", "found_share",
                                             "mae_mm_visible", "found_share_visible"});
    int occluded = 0;
    for (int image = 1; image <= 2; ++image) {
        REQUIRE(samples.next());
        CHECK(samples.integer(0) == image);
        const std::string png = cv::format("%03d.png", image);
        const cv::Mat depth = read(clip / cv::format("depth/%06d.tiff", image));
        const cv::Mat true_depth = read(truth / "DepthL" / png);
        const cv::Mat occlusion = read(truth / "OcclusionL" / png);
        double sum[2] = {}, count[2] = {};
        for (int v = 0; v < kHeight; ++v) {
            for (int u = 0; u < kWidth; ++u) {
                const auto colour = occlusion.at<cv::Vec3b>(v, u);
                if (colour == cv::Vec3b(255, 0, 0)) continue;
                const bool is_occluded = colour != cv::Vec3b(0, 0, 0);
                occluded += is_occluded;
                const double z = true_depth.at<std::uint16_t>(v, u) / 256.0;
                CHECK(z > 0);
                const float found = depth.at<float>(v, u);
                if (found == 0) continue;
                for (int part = 0; part < (is_occluded ? 1 : 2); ++part) {
                    sum[part] += std::abs(found - z);
                    ++count[part];
                }
            }
        }
        CHECK(samples.number(2) == doctest::Approx(sum[0] / count[0]));
        CHECK(samples.number(4) == doctest::Approx(sum[1] / count[1]));
        CHECK(samples.number(1) < 1);
        CHECK(samples.number(4) < 1);
        CHECK(samples.number(5) > 0.6);
        CHECK(samples.number(5) > samples.number(3));
    }
    CHECK_FALSE(samples.next());
    CHECK(occluded > 100);
}

TEST_CASE("a shift of the true disparity shows as that shift") {
    const TestFolder root, out;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    const fs::path file = root.path() / "Experiment_1/Ground_truth_CT/Disparity/002.png";
    cv::Mat disparity = read(file);
    constexpr int kShift = 40;  // px, more than any error
    for (int v = 0; v < kHeight; ++v)
        for (int u = 0; u < kWidth; ++u)
            if (auto& value = disparity.at<std::uint16_t>(v, u)) value += 256 * kShift;
    cv::imwrite(file.string(), disparity);
    REQUIRE(evaluate(root.path(), out.path()) == 0);
    CsvReader samples(ClipStore(out.path()).folder({"defrec", "Experiment_1"}) / "samples.csv",
                      {"epe_px", "bad3_share", "mae_mm"});
    REQUIRE(samples.next());
    CHECK(samples.number(1) < 0.1);
    REQUIRE(samples.next());
    CHECK(samples.number(0) == doctest::Approx(kShift).epsilon(0.02));
    CHECK(samples.number(1) == 1);
    CHECK(samples.number(2) < 1);
}

TEST_CASE("what is not as expected is named") {
    const TestFolder root;
    const auto copy = [&](const char* name) {
        const fs::path to = root.path() / name;
        fs::copy(data_set().path() / "Experiment_1", to, fs::copy_options::recursive);
        return to;
    };
    fs::remove_all(copy("no_truth") / "Ground_truth_CT/DepthL");
    fs::remove(copy("no_right") / "Right_rectified/002.png");
    fs::copy_file(data_set() / "Experiment_1/Left_rectified/001.png",
                  copy("a_picture") / "Ground_truth_CT/Disparity/001.png",
                  fs::copy_options::overwrite_existing);
    std::ofstream(copy("no_json") / "Rectified_calibration/001.json") << "P1: 3";
    std::ofstream(copy("no_matrix") / "Rectified_calibration/001.json")
        << R"({"P1": [[1, 2], [3, 4]], "P2": []})";
    fs::rename(copy("unnumbered") / "Left_rectified/001.png",
               root / "unnumbered/Left_rectified/first.png");
    const TestFolder out;
    REQUIRE(evaluate(root.path(), out.path()) == 6);
    auto reasons = reasons_of(out.path());
    const auto says = [&](const char* clip, const char* text) {
        INFO(clip << ": " << reasons[clip]);
        CHECK(reasons[clip].find(text) != std::string::npos);
    };
    says("no_truth", "Ground_truth_CT/DepthL: this folder was expected");
    says("no_right", "Right_rectified/002.png: this file was expected");
    says("a_picture", "a gray image of 16 bits and 320x240 was expected");
    says("no_json", "001.json: JSON with P1 and P2 was expected");
    says("no_matrix", "001.json: P1; a 3x4 matrix of numbers; was expected");
    says("unnumbered", "Right_rectified/first.png: this file was expected");
}
