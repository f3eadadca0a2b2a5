// STIR 2024 and 2025: metrics by hand, rendered data in, malformed copies.
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "sdk/evaluation/data_sets/stir_metrics.hpp"
#include "sdk/evaluation/layout_test.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kWidth = 320, kHeight = 240;
const char* const kClip = "1/left/seq00";

const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made = (render_layout_to(folder.path(), "heartbeat", "stir", 6), true);
    static_cast<void>(is_made);
    return folder;
}

// The one member of a file of predictions.
std::vector<std::vector<double>> predictions(const fs::path& file) {
    const auto json = nlohmann::json::parse(TestFolder::read(file));
    REQUIRE(json.size() == 1);
    return json.begin().value().get<std::vector<std::vector<double>>>();
}

}  // namespace

TEST_CASE("errors by hand: to the nearest point, thresholds inclusive, then their mean") {
    const std::vector<cv::Point3d> truth{{0, 0, 0}, {100, 0, 0}};
    const std::vector<double> errors =
        nearest_errors({{3, 4, 0}, {104, 0, 0}, {60, 30, 0}, {0, 200, 0}, {100, 0, 1}}, truth);
    CHECK(errors == std::vector<double>{5, 4, 50, 200, 1});
    const auto shares = shares_within(errors, kStirPixels);
    CHECK(shares[0] == doctest::Approx(0.4));  // 4 is within 4
    CHECK(shares[1] == doctest::Approx(0.6));
    CHECK(shares[3] == doctest::Approx(0.6));
    CHECK(shares[4] == doctest::Approx(0.8));
    CHECK(shares[5] == doctest::Approx((0.4 + 0.6 + 0.6 + 0.6 + 0.8) / 5));
    CHECK(std::isnan(shares_within({}, kStirPixels)[5]));
}

TEST_CASE("a clip's metrics are of its points in 2D and in 3D") {
    const DataSet& stir = data_set_of("stir");
    Samples samples(stir.sample_columns());
    const double none = std::nan("");
    samples.add({2, 3, 5});
    samples.add({2, 20, 20});
    samples.add({3, 2, none});
    samples.add({3, 9, none});
    const std::vector<double> values = stir.summarise(samples);
    const std::vector<Metric> metrics = stir.metrics();
    REQUIRE(values.size() == metrics.size());
    const auto value = [&](const std::string& name) {
        for (std::size_t i = 0; i < metrics.size(); ++i)
            if (metrics[i].name == name) return values[i];
        return none;
    };
    CHECK(value("average_px") == doctest::Approx((0.5 + 0.5 + 0.5 + 1 + 1) / 5));
    CHECK(value("within_4_px") == 0.5);
    CHECK(value("within_64_px") == 1);
    CHECK(value("mean_px") == 11.5);
    CHECK(value("still_average_px") == doctest::Approx((0 + 0.5 + 0.5 + 1 + 1) / 5));
    CHECK(value("average_mm") == doctest::Approx((0.5 + 0.5 + 0.5 + 1 + 1) / 5));
    CHECK(value("within_2_mm") == 0.5);
    CHECK(value("median_mm") == 5.5);
}

TEST_CASE("marks are the centres of the rectangles round contours, those of holes too") {
    cv::Mat image = cv::Mat::zeros(60, 80, CV_8U);
    image(cv::Rect(10, 20, 4, 5)).setTo(255);  // 10 + 4 / 2, 20 + 5 / 2
    image(cv::Rect(40, 10, 21, 21)).setTo(90);
    image(cv::Rect(45, 15, 5, 5)).setTo(0);
    std::vector<cv::Point> centres;
    for (const StirMark& mark : stir_marks(image)) centres.push_back(mark.centre());
    std::sort(centres.begin(), centres.end(),
              [](const cv::Point& a, const cv::Point& b) { return a.x < b.x; });
    REQUIRE(centres.size() == 3);
    CHECK(centres[0] == cv::Point(12, 22));
    CHECK(centres[1] == cv::Point(47, 17));  // the hole's contour lies on the pixels round it
    CHECK(centres[2] == cv::Point(50, 20));
    CHECK(stir_marks(cv::Mat::zeros(9, 9, CV_8U)).empty());
}

TEST_CASE("a mark's place is by the right mark that looks like it, within rows and disparities") {
    cv::Mat left(100, 300, CV_8UC3), right;
    cv::randu(left, 0, 255);
    right = cv::Mat::zeros(left.size(), left.type());
    const StirMark mark{{200, 40, 11, 11}};  // centre 205, 45
    const auto shifted = [&](int disparity, int rows) {
        return StirMark{mark.box - cv::Point(disparity, -rows)};
    };
    left(mark.box).copyTo(right(mark.box - cv::Point(30, 0)));
    const StirStereo stereo{500, 160, 50, 162, 4};  // the right centre is 2 px farther right
    const auto places = [&](const std::vector<StirMark>& candidates) {
        return stir_places({mark}, candidates, left, right, stereo);
    };
    const auto found = places({shifted(60, 0), shifted(30, 0), shifted(50, 0)});
    REQUIRE(found.size() == 1);
    const double z = 500 * 4 / 32.0;
    CHECK(found[0].z == doctest::Approx(z));
    CHECK(found[0].x == doctest::Approx((205 - 160) * z / 500));
    CHECK(found[0].y == doctest::Approx((45 - 50) * z / 500));
    CHECK(places({shifted(30, 10)}).size() == 1);
    CHECK(places({shifted(30, 11)}).empty());
    CHECK(places({shifted(6, 0)}).size() == 1);  // 8 px with the centres' 2
    CHECK(places({shifted(5, 0)}).empty());
    CHECK(places({shifted(103, 0)}).size() == 1);
    CHECK(places({shifted(104, 0)}).empty());
    CHECK(places({}).empty());
}

TEST_CASE("rendered data in, and the score is that of the predictions that were written") {
    const TestFolder out;
    REQUIRE(evaluate_set("stir", data_set().path(), out.path()) == 0);
    const auto found = predictions(out.path() / "predictions/defrec/positions.json");
    const auto found3d = predictions(out.path() / "predictions/defrec/positions3d.json");
    const cv::Mat marks = cv::imread(
        (data_set().path() / kClip / "segmentation/icgendseg.png").string(), cv::IMREAD_GRAYSCALE);
    cv::Mat labels, boxes, centres;
    const int count = cv::connectedComponentsWithStats(marks, labels, boxes, centres);
    REQUIRE(count > 8);
    double sum = 0;
    std::vector<double> errors;
    for (const auto& point : found) {
        double nearest = INFINITY;
        for (int i = 1; i < count; ++i) {
            nearest = std::min(nearest, std::hypot(centres.at<double>(i, 0) - point.at(0),
                                                   centres.at<double>(i, 1) - point.at(1)));
        }
        errors.push_back(nearest);
        sum += nearest;
    }
    REQUIRE(found3d.size() == found.size());
    CHECK(result_of(out.path(), kClip, "mean_px") ==
          doctest::Approx(sum / static_cast<double>(errors.size())));
    CHECK(result_of(out.path(), kClip, "median_px") < 1.5);   // marks are whole pixels
    CHECK(result_of(out.path(), kClip, "average_px") > 0.9);  // a mark may have left the image
    CHECK(result_of(out.path(), kClip, "median_mm") < 4);     // their disparity too
    CHECK(result_of(out.path(), kClip, "within_32_mm") > 0.9);
    CHECK(fs::exists(ClipStore(out.path()).folder({"defrec", kClip}) / kPictureFile));
}

TEST_CASE("marks that are moved change the score by as much") {
    const TestFolder root, out;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    const fs::path file = root.path() / kClip / "segmentation/icgendseg.png";
    cv::Mat marks = cv::Mat::zeros(kHeight, kWidth, CV_8U);
    marks(cv::Rect(0, 0, 3, 3)).setTo(255);
    cv::imwrite(file.string(), marks);
    REQUIRE(evaluate_set("stir", root.path(), out.path()) == 0);
    double sum = 0;
    const auto found = predictions(out.path() / "predictions/defrec/positions.json");
    for (const auto& point : found) sum += std::hypot(point.at(0) - 1, point.at(1) - 1);
    CHECK(result_of(out.path(), kClip, "mean_px") ==
          doctest::Approx(sum / static_cast<double>(found.size())));
    CHECK(result_of(out.path(), kClip, "within_8_px") == 0);
}

TEST_CASE("the baseline is measured in the same way") {
    const TestFolder out;
    REQUIRE(evaluate_set("stir", data_set().path(), out.path(), {"--method", "opencv"}) == 0);
    CHECK(result_of(out.path(), kClip, "average_px") > 0.7);
    CHECK(fs::exists(out.path() / "predictions/opencv/positions.json"));
}

TEST_CASE("what is not as expected is named") {
    BrokenCopies copies(data_set().path() / "1");
    const std::string sequence = "left/seq00";
    fs::remove(copies.copy("no_calibration") / "calib.json");
    std::ofstream(copies.copy("not_json") / "calib.json") << "leftcameramat: 3";
    const std::string calibration = TestFolder::read(data_set().path() / "1/calib.json");
    std::ofstream(copies.copy("no_translation") / "calib.json")
        << with(calibration, "translation", "position");
    std::ofstream(copies.copy("distorted") / "calib.json") << with(
        calibration, "\"rightdistortioncoeffs\": [0, ", "\"rightdistortioncoeffs\": [0.1, ");
    fs::remove(copies.copy("no_end") / sequence / "segmentation/icgendseg.png");
    fs::remove_all(copies.copy("no_video") / "right/seq00/frames");
    const fs::path two = copies.copy("two_videos") / sequence / "frames";
    fs::copy_file(*fs::directory_iterator(two), two / "second.mp4");
    cv::imwrite((copies.copy("no_marks") / sequence / "segmentation/icgstartseg.png").string(),
                cv::Mat::zeros(kHeight, kWidth, CV_8U));
    fs::remove_all(copies.copy("no_right") / "right");
    copies.evaluate("stir");
    const auto says = [&](const std::string& clip, const char* text) {
        copies.says(clip + "/" + sequence, text);
    };
    says("no_calibration", "calib.json: this file was expected");
    says("not_json", "calib.json: JSON with leftcameramat");
    says("no_translation", "calib.json: translation; 3 numbers; in m; was expected");
    says("distorted", "rightdistortioncoeffs; zeros were expected");
    says("no_end", "icgendseg.png: this file was expected: the marks in the last frame");
    says("no_video", "right/seq00/frames: one file *.mp4 was expected here");
    says("two_videos",
         "left/seq00/frames: one file *.mp4 was expected here; the clip's video; "
         "there are 2");
    says("no_marks", "icgstartseg.png: marks that are not black were expected");
    says("no_right", "right/seq00/segmentation/icgstartseg.png: this file was expected");
}
