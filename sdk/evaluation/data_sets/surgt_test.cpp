// SurgT: metrics by hand, rendered data in, malformed copies.
#include <cmath>
#include <nlohmann/json.hpp>

#include "sdk/evaluation/data_sets/surgt_metrics.hpp"
#include "sdk/evaluation/layout_test.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;
using Json = nlohmann::json;

namespace {

constexpr char kClip[] = "data/validation/case_1/1";
constexpr std::size_t kFrames = 6;

const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made =
        (render_layout_to(folder.path(), "heartbeat", "surgt", kFrames), true);
    static_cast<void>(is_made);
    return folder;
}

// f = 100 px, baseline 10 mm, centre (0, 0): z = 1000 / disparity.
const cv::Matx44d kQ(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 100, 0, 0, 0.1, 0);

BoxPair boxes_at(double u) { return {{{u, 50, 20, 20}, {u - 10, 50, 20, 20}}}; }
TrueBoxes seen_at(double u) { return {true, false, boxes_at(u)}; }

using Predictions = std::vector<std::optional<BoxPair>>;

// Mean overlap of one of the clip's predictions with the truth, worked out anew.
double mean_overlap(const fs::path& root, const fs::path& predictions) {
    const Json of_clip = Json::parse(TestFolder::read(predictions))["validation/case_1/1"];
    double sum = 0;
    int count = 0;
    for (std::size_t keypoint = 0; keypoint < 2; ++keypoint) {
        std::istringstream lines(TestFolder::read(
            root / kClip / ("gt_rectified_" + std::to_string(keypoint) + ".yaml")));
        std::vector<Json> truth;  // its lines are JSON
        for (std::string line; std::getline(lines, line);)
            truth.push_back(Json::parse(line.substr(2)));
        for (const Json& of_anchor : of_clip[keypoint]) {
            std::size_t frame = of_anchor["first"];
            for (const Json& boxes : of_anchor["boxes"]) {
                const Json& is = truth[++frame];
                if (!is[0].get<bool>() || is[1].get<bool>() || boxes.is_null()) continue;
                for (std::size_t view = 0; view < 2; ++view) {
                    const auto a = is[2][view].get<std::array<double, 4>>();
                    const auto b = boxes[view].get<std::array<double, 4>>();
                    const cv::Rect2d first(a[0], a[1], a[2], a[3]), second(b[0], b[1], b[2], b[3]);
                    const double common = (first & second).area();
                    sum += common / (first.area() + second.area() - common);
                    ++count;
                }
            }
        }
    }
    return sum / count;
}

void change(const fs::path& file, const std::string& from, const std::string& to) {
    std::string text = TestFolder::read(file);
    const std::size_t place = text.find(from);
    REQUIRE(place != std::string::npos);
    std::ofstream(file) << text.replace(place, from.size(), to);
}

}  // namespace

TEST_CASE("overlap and centre of boxes") {
    CHECK(overlap_of({0, 0, 4, 4}, {0, 0, 4, 4}) == 1);
    CHECK(overlap_of({0, 0, 4, 4}, {4, 0, 4, 4}) == 0);  // they touch
    CHECK(overlap_of({0, 0, 4, 4}, {9, 9, 4, 4}) == 0);
    CHECK(overlap_of({0, 0, 4, 4}, {2, 2, 4, 4}) == doctest::Approx(4.0 / 28));
    CHECK(overlap_of({0, 0, 4, 4}, {0, 2, 4, 2}) == doctest::Approx(0.5));
    CHECK(box_centre({10, 20, 5, 3}) == cv::Point(12, 21));  // 12.5, 21.5
}

TEST_CASE("overlap, errors and hits of frames by hand") {
    const std::vector<TrueBoxes> truth{seen_at(50),
                                       seen_at(50),
                                       seen_at(50),
                                       {true, true, boxes_at(50)},  // difficult
                                       {false, false, std::nullopt},
                                       {false, false, boxes_at(50)},
                                       seen_at(50),
                                       seen_at(50)};
    BoxPair closer = boxes_at(50);
    closer[1].u -= 10;  // twice the disparity: at 50 mm, not 100
    const auto frames = assess_boxes(
        truth, 0,
        {boxes_at(50), boxes_at(54), boxes_at(0), boxes_at(0), boxes_at(50), std::nullopt, closer},
        kQ);
    REQUIRE(frames.size() == 7);
    CHECK(frames[0].overlap == 1);
    CHECK(frames[0].error_px == 0);
    CHECK(frames[0].error_mm == 0);
    CHECK((frames[0].is_hit_2d && frames[0].is_hit_3d));
    CHECK(frames[1].overlap == doctest::Approx(16.0 / 24));
    CHECK(frames[1].error_px == 4);
    CHECK(frames[1].error_mm == doctest::Approx(4));  // 100 mm away
    // A difficult frame counts nowhere, an invisible box where it was predicted.
    CHECK(!frames[2].is_counted);
    CHECK(std::isnan(frames[2].overlap_in_curve));
    CHECK(frames[3].is_counted);
    CHECK(!frames[3].is_hit_2d);
    CHECK(std::isnan(frames[3].overlap_in_curve));
    CHECK(frames[3].times_in_curve == 1);
    CHECK(!frames[4].is_counted);  // it has a truth
    CHECK(frames[5].is_counted);
    CHECK(frames[5].overlap_in_curve == 0);
    CHECK(std::isnan(frames[5].overlap));
    // (60, 60) at 100 mm and at 50: (60, 60, 100) and (30, 30, 50).
    CHECK(frames[6].error_mm == doctest::Approx(std::sqrt(30 * 30 + 30 * 30 + 50 * 50)));
    CHECK(frames[6].error_px == 5);  // 0 and 10
}

TEST_CASE("a tracker has failed at the 11th miss in a row, and these are taken back") {
    const std::vector<TrueBoxes> truth(30, seen_at(50));
    Predictions predicted(29, boxes_at(60));                           // overlap 1/3
    for (std::size_t i = 5; i < 15; ++i) predicted[i] = boxes_at(69);  // 1/39
    auto frames = assess_boxes(truth, 0, predicted, kQ);
    CHECK(frames[14].overlap == doctest::Approx(1.0 / 39));  // 10 misses
    CHECK(frames[28].is_hit_2d);

    predicted[15] = boxes_at(69);
    frames = assess_boxes(truth, 0, predicted, kQ);
    CHECK(frames[4].overlap == doctest::Approx(1.0 / 3));
    for (std::size_t i = 5; i < frames.size(); ++i) {
        CHECK(std::isnan(frames[i].overlap));
        CHECK(std::isnan(frames[i].error_px));
        CHECK(frames[i].is_hit_3d);  // 19 mm off
        CHECK(frames[i].is_counted);
    }
    CHECK(frames[15].overlap_in_curve == doctest::Approx(1.0 / 39));
    CHECK(frames[15].times_in_curve == 1);
    CHECK(frames[16].overlap_in_curve == 0);
    CHECK(frames[16].times_in_curve == 2);  // it goes on in 3D

    for (auto& boxes : predicted) boxes.reset();
    frames = assess_boxes(truth, 0, predicted, kQ);
    CHECK(frames[28].times_in_curve == 1);  // failed in both
    CHECK(frames[28].is_counted);
    CHECK(std::isnan(frames[28].error_mm));
}

TEST_CASE("a sub-sequence ends at the last frame that counts") {
    std::vector<TrueBoxes> truth(6, seen_at(50));
    truth[4] = truth[5] = {true, true, boxes_at(50)};
    const auto frames = assess_boxes(truth, 1, Predictions(4, boxes_at(50)), kQ);
    CHECK(frames[1].times_in_curve == 1);
    CHECK(frames[2].times_in_curve == 0);
}

TEST_CASE("expected average overlap by hand") {
    const OverlapCurve curve =
        mean_curve({{1.0, 0.5, std::nullopt, 0.2}, {0.0, std::nullopt, std::nullopt}});
    REQUIRE(curve.size() == 4);
    CHECK(curve[0] == 0.5);
    CHECK(curve[1] == 0.5);
    CHECK(!curve[2]);
    CHECK(curve[3] == 0.2);
    CHECK(expected_average_overlap(curve, 0, 4) == doctest::Approx(1.2 / 3));
    CHECK(expected_average_overlap(curve, 1, 3) == 0.5);
    CHECK(expected_average_overlap(curve, 3, 829) == 0.2);
    CHECK(std::isnan(expected_average_overlap(curve, 4, 829)));
    CHECK(expected_average_overlap({}, 0, 4) == 0);
}

TEST_CASE("rendered data in, and the score is that of the predictions that were written") {
    const TestFolder out;
    REQUIRE(evaluate_set("surgt", data_set().path(), out.path()) == 0);
    const double accuracy = result_of(out.path(), kClip, "accuracy");
    CHECK(accuracy == doctest::Approx(mean_overlap(data_set().path(),
                                                   out.path() / "predictions/defrec/boxes.json")));
    CHECK(accuracy > 0.8);  // true boxes are in whole pixels
    CHECK(result_of(out.path(), kClip, "eao") > 0.8);
    CHECK(result_of(out.path(), kClip, "robustness_2d") == 1);
    CHECK(result_of(out.path(), kClip, "robustness_3d") == 1);
    CHECK(result_of(out.path(), kClip, "error_2d_px") < 3);
    const Json boxes = Json::parse(
        TestFolder::read(out.path() / "predictions/defrec/boxes.json"))["validation/case_1/1"];
    REQUIRE(boxes.size() == 2);
    REQUIRE(boxes[0].size() == 2);  // two anchors
    CHECK(boxes[0][1]["anchor"] == kFrames / 2);
    CHECK(boxes[0][0]["boxes"].size() == kFrames - 1);
}

TEST_CASE("a true box that is moved changes the score as it must") {
    const TestFolder root, out, far;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    const auto move = [&](int by) {
        for (const char* name : {"gt_rectified_0.yaml", "gt_rectified_1.yaml"}) {
            std::istringstream lines(TestFolder::read(data_set().path() / kClip / name));
            std::ofstream moved(root.path() / kClip / name);
            std::size_t frame = 0;
            for (std::string line; std::getline(lines, line); ++frame) {
                Json truth = Json::parse(line.substr(2));
                // The boxes that are given stay: frames 0 and kFrames / 2.
                if (frame % (kFrames / 2) != 0)
                    for (Json& box : truth[2]) box[1] = box[1].get<int>() + by;
                moved << "- " << truth << "\n";
            }
        }
    };
    move(4);
    REQUIRE(evaluate_set("surgt", root.path(), out.path()) == 0);
    const double accuracy = result_of(out.path(), kClip, "accuracy");
    CHECK(accuracy ==
          doctest::Approx(mean_overlap(root.path(), out.path() / "predictions/defrec/boxes.json")));
    CHECK(accuracy < 0.9);
    CHECK(result_of(out.path(), kClip, "robustness_2d") == 1);
    CHECK(result_of(out.path(), kClip, "error_2d_px") > 2);
    move(60);  // more than the box is high
    REQUIRE(evaluate_set("surgt", root.path(), far.path()) == 0);
    CHECK(result_of(far.path(), kClip, "robustness_2d") < 0.5);
    CHECK(result_of(far.path(), kClip, "robustness_3d") == 1);
}

TEST_CASE("without the tool's file a tracker begins every 50 frames, and the window is its own") {
    const TestFolder root, out;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    fs::remove(root.path() / "config.yaml");
    REQUIRE(evaluate_set("surgt", root.path(), out.path()) == 0);
    CHECK(result_of(out.path(), kClip, "accuracy") > 0.8);
    const std::string results = TestFolder::read(out.path() / "results.csv");
    CHECK(results.find(",done,6,,") != std::string::npos);  // no frame is in the window
}

TEST_CASE("truth with the frames as keys is read as a list is") {
    const TestFolder root, out, usual;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    for (const char* name : {"gt_rectified_0.yaml", "gt_rectified_1.yaml"}) {
        std::istringstream lines(TestFolder::read(data_set().path() / kClip / name));
        std::ofstream file(root.path() / kClip / name);
        int frame = 0;
        for (std::string line; std::getline(lines, line); ++frame)
            file << frame << ": " << line.substr(2) << "\n";
    }
    REQUIRE(evaluate_set("surgt", root.path(), out.path()) == 0);
    REQUIRE(evaluate_set("surgt", data_set().path(), usual.path()) == 0);
    CHECK(TestFolder::read(out.path() / "results.csv") ==
          TestFolder::read(usual.path() / "results.csv"));
}

TEST_CASE("what is not as expected is named") {
    BrokenCopies copies(data_set().path() / kClip);
    const auto edit = [&](const char* clip, const char* file, const char* from, const char* to) {
        change(copies.copy(clip) / file, from, to);
    };
    fs::remove(copies.copy("no_calibration") / "calibration.yaml");
    fs::remove(copies.copy("no_video") / "video.mp4");
    fs::remove(copies.copy("no_truth") / "gt_rectified_1.yaml");
    edit("odd_stack", "info.yaml", "vertical", "diagonal");
    edit("no_size", "info.yaml", "width", "breadth");
    edit("other_size", "info.yaml", "width: 320", "width: 640");
    edit("no_flag", "gt_rectified_0.yaml", "true", "maybe");
    edit("no_boxes", "gt_rectified_0.yaml", "- [true, false, ", "- [true, false, null] #");
    edit("short_box", "gt_rectified_0.yaml", ", 40, 40]", ", 40]");
    const fs::path few = copies.copy("few_frames") / "gt_rectified_1.yaml";
    const std::string text = TestFolder::read(few);
    std::ofstream(few) << text.substr(0, text.find('\n') + 1);
    copies.evaluate("surgt");
    copies.says("no_calibration", "calibration.yaml: this file was expected");
    copies.says("no_video", "video.mp4: this file was expected: the video that info.yaml names");
    copies.says("no_truth", "gt_rectified_1.yaml: this file was expected");
    copies.says("odd_stack", "info.yaml:1: video_stack: vertical or horizontal was expected");
    copies.says("no_size", "info.yaml:2: width: a number of pixels was expected");
    copies.says("other_size", "views of 640x240 were expected; those of video.mp4 are 320x240");
    copies.says("no_flag", "gt_rectified_0.yaml:1: frame 0: true or false was expected");
    copies.says("no_boxes", "frame 0: boxes were expected; since both views show them");
    copies.says("short_box", "frame 0: a box [u; v; width; height] was expected");
    copies.says("few_frames", "the truth of 6 frames was expected; as many as video.mp4 has");
}

TEST_CASE("row 122: files that a clip names lie in its own folder") {
    BrokenCopies copies(data_set().path() / kClip);
    const std::string elsewhere =
        "name_video: " + (data_set().path() / kClip / "video.mp4").string();
    change(copies.copy("absolute") / "info.yaml", "name_video: video.mp4", elsewhere.c_str());
    change(copies.copy("above") / "info.yaml", "name_video: video.mp4", "name_video: ../video.mp4");
    change(copies.copy("truth") / "info.yaml", "gt_rectified_0.yaml", "../gt_rectified_0.yaml");
    copies.evaluate("surgt");
    copies.says("absolute", "name_video: a file name without a folder was expected");
    copies.says("above", "name_video: a file name without a folder was expected");
    copies.says("truth", "name_ground_truth: a file name without a folder was expected");
}
