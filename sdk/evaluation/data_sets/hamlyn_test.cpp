// Hamlyn: errors by hand, rendered data in, malformed copies.
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "sdk/evaluation/data_sets/hamlyn_errors.hpp"
#include "sdk/evaluation/layout_test.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 2;

const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made =
        (render_layout_to(folder.path(), "heartbeat", "hamlyn", kFrames), true);
    static_cast<void>(is_made);
    return folder;
}

// Mean absolute error of the depth that the clip left, worked out anew; mm.
double mean_abs(const fs::path& root, const fs::path& out) {
    double mean = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
        const std::string number = std::to_string(frame);
        const cv::Mat is =
            cv::imread((root / "rectified01/depth" / ("000000000" + number + ".png")).string(),
                       cv::IMREAD_UNCHANGED);
        const cv::Mat found = cv::imread(
            (out / "clips/defrec/rectified01/depth" / ("00000" + number + ".tiff")).string(),
            cv::IMREAD_UNCHANGED);
        cv::Mat truth, difference;
        is.convertTo(truth, CV_32F);
        cv::absdiff(truth, found, difference);
        mean += cv::mean(difference, (truth >= 1) & (truth <= 300) & (found > 0))[0] / kFrames;
    }
    return mean;
}

}  // namespace

TEST_CASE("errors of depth by hand") {
    const cv::Mat truth = (cv::Mat_<float>(1, 5) << 100, 100, 100, 0, 100);
    const cv::Mat depth = (cv::Mat_<float>(1, 5) << 100, 110, 75, 50, 0);
    const HamlynErrors errors = hamlyn_errors(truth, depth);
    CHECK(errors.mean_abs_mm == doctest::Approx(35.0 / 3));
    CHECK(errors.rms_mm == doctest::Approx(std::sqrt(725.0 / 3)));
    CHECK(errors.abs_rel == doctest::Approx(0.35 / 3));
    CHECK(errors.within_share == doctest::Approx(2.0 / 3));  // 100 / 75 is 1.33
    CHECK(errors.found_share == doctest::Approx(3.0 / 4));
    CHECK(std::isnan(hamlyn_errors(truth, cv::Mat::zeros(1, 5, CV_32F)).rms_mm));
    CHECK(hamlyn_errors(truth, cv::Mat::zeros(1, 5, CV_32F)).found_share == 0);
}

TEST_CASE("rendered data in, and the score is that of the depth that was written") {
    const TestFolder out, more;
    REQUIRE(evaluate_set("hamlyn", data_set().path(), out.path()) == 0);
    const double mean = result_of(out.path(), "rectified01", "pseudo_mean_abs_mm");
    CHECK(mean == doctest::Approx(mean_abs(data_set().path(), out.path())).epsilon(1e-4));
    CHECK(mean < 2);  // truth is in whole mm
    CHECK(result_of(out.path(), "rectified01", "pseudo_found_share") > 0.5);

    // Truth that is 10 mm farther: the depth that was found is as much nearer.
    const TestFolder root;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    for (const auto& entry : fs::directory_iterator(root.path() / "rectified01/depth")) {
        cv::Mat depth = cv::imread(entry.path().string(), cv::IMREAD_UNCHANGED);
        cv::add(depth, 10, depth, depth > 0);
        cv::imwrite(entry.path().string(), depth);
    }
    REQUIRE(evaluate_set("hamlyn", root.path(), more.path()) == 0);
    const double moved = result_of(more.path(), "rectified01", "pseudo_mean_abs_mm");
    CHECK(moved == doctest::Approx(mean_abs(root.path(), more.path())).epsilon(1e-4));
    CHECK(moved > mean + 7);
    CHECK(moved <= mean + 10 + 1e-6);
}

TEST_CASE("images in image01, and in a folder of the sequence's name, are found") {
    const TestFolder root, out, usual;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    const fs::path clip = root.path() / "rectified01";
    fs::create_directories(clip / "rectified01");
    fs::rename(clip / "color", clip / "rectified01/image01");
    fs::rename(clip / "image02", clip / "rectified01/image02");
    REQUIRE(evaluate_set("hamlyn", root.path(), out.path()) == 0);
    REQUIRE(evaluate_set("hamlyn", data_set().path(), usual.path()) == 0);
    CHECK(TestFolder::read(out.path() / "results.csv") ==
          TestFolder::read(usual.path() / "results.csv"));
}

TEST_CASE("what is not as expected is named") {
    BrokenCopies copies(data_set().path() / "rectified01");
    fs::remove(copies.copy("no_pose") / "extrinsics.txt");
    fs::remove_all(copies.copy("no_right") / "image02");
    fs::remove_all(copies.copy("no_left") / "color");
    fs::remove(copies.copy("few_depths") / "depth/0000000001.png");
    std::ofstream(copies.copy("short") / "intrinsics.txt") << "300 0 160 0";
    std::ofstream(copies.copy("words") / "extrinsics.txt") << "1 0 0 left 0 1 0 0 0 0 1 0";
    cv::imwrite((copies.copy("colour") / "depth/0000000000.png").string(),
                cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(80)));
    copies.evaluate("hamlyn");
    copies.says("no_pose", "extrinsics.txt: this file was expected");
    copies.says("no_right", "image02; the right images; was expected here");
    copies.says("no_left", "color or image01; the left images; was expected here");
    copies.says("few_depths", "as many images as in");
    copies.says("short", "intrinsics.txt: a 3x3; 3x4 or 4x4 matrix was expected");
    copies.says("words", "extrinsics.txt: a 3x4 or 4x4 matrix");
    copies.says("colour", "a gray image of 16 bits and 320x240 was expected; mm");
}
