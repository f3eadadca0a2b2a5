// The baseline on rendered data, where it must work, and beside the library.
#include "sdk/evaluation/data_sets/opencv_method.hpp"

#include <map>

#include "sdk/evaluation/data_sets/test_plane.hpp"
#include "sdk/evaluation/program_run.hpp"
#include "sdk/evaluation/score/scored_rows.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/scenes/writing/test_sequence.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 4;

TrackOptions options_of(const TestFolder& sequence) {
    TrackOptions options;
    options.source.left = sequence / "left";
    options.source.right = sequence / "right";
    options.calibration = sequence / "calibration.yaml";
    options.points = sequence / "points.csv";
    return options;
}

}  // namespace

TEST_CASE("points of a textured plane that does not move stay where they are, at its depth") {
    // f 400, baseline 5, disparity 20: z = 100 mm.
    constexpr int kWidth = 320, kHeight = 240, kDisparity = 20;
    const auto meter = make_opencv_depth_meter(plane_cameras({kWidth, kHeight}));
    const cv::Mat depth = meter->depth_of(plane_frame({kWidth, kHeight}, kDisparity));
    int found = 0;
    for (int v = 20; v < kHeight - 20; ++v) {
        for (int u = kDisparity + 10; u < kWidth - 20; ++u) {
            if (depth.at<float>(v, u) == 0) continue;
            ++found;
            REQUIRE(depth.at<float>(v, u) == doctest::Approx(100).epsilon(0.01));
        }
    }
    CHECK(found > 45000);
}

TEST_CASE("most points of a beat are followed, and the others are lost without a position") {
    const TestFolder& sequence = rendered_sequence<kFrames>();
    const TestFolder out;
    track_by_opencv(options_of(sequence), out.path());
    const ScoredRows scored =
        read_scored_rows(out.path(), sequence / "truth.csv", {}, Unfollowed::kLost);
    CHECK(scored.has_pixels);
    std::vector<double> errors;
    for (const ScoredRow& row : scored.rows) {
        CHECK_FALSE(row.expected_mm);
        if (row.truly_visible && row.error_mm) errors.push_back(*row.error_mm);
    }
    CHECK(errors.size() > scored.rows.size() / 2);
    std::sort(errors.begin(), errors.end());
    CHECK(errors[errors.size() / 2] < 1);
}

TEST_CASE("methods stand beside each other in one table") {
    const TestFolder out;
    const fs::path root = rendered_sequence<kFrames>().path();
    REQUIRE(run_evaluate_program({"--dataset", "defrec", root.string(), "--out",
                                  out.path().string(), "--backend", "cpu", "--quiet", "--method",
                                  "defrec", "--method", "opencv", "--method", "still"}) == 0);
    CsvReader summary(out.path() / "summary.csv", {"variant", "quarantined", "median_mm"});
    for (const char* variant : {"defrec", "opencv"}) {
        REQUIRE(summary.next());
        CHECK(summary.field(0) == variant);
        CHECK(summary.integer(1) == 0);
        CHECK(summary.number(2) < 1);
    }
    REQUIRE(summary.next());
    CHECK(summary.field(0) == "still");
    CHECK(summary.number(2) > 0.2);  // the heart beats
}

TEST_CASE("points of the control are in each frame where the first one has them") {
    const TestFolder& sequence = rendered_sequence<kFrames>();
    const TestFolder out;
    leave_points(options_of(sequence), out.path());
    CsvReader rows(out.path() / "points.csv", {"frame", "id", "x", "y", "z"});
    std::map<std::int64_t, std::string> first;
    std::size_t later = 0;
    while (rows.next()) {
        const std::string place = std::string(rows.field(2)) + "," + std::string(rows.field(3)) +
                                  "," + std::string(rows.field(4));
        if (place == ",,") continue;
        const auto [known, is_new] = first.emplace(rows.integer(1), place);
        if (is_new) continue;
        CHECK(place == known->second);
        ++later;
    }
    CHECK(later >= 3 * first.size() / 2);

    StereoCalibration calibration;
    calibration.width = 64;
    calibration.height = 48;
    calibration.left = {100, 100, 31.5, 23.5, {}, {}, {}};
    calibration.right = calibration.left;
    calibration.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    calibration.translation = {-5, 0, 0};
    const auto meter = make_still_depth_meter(calibration);
    cv::Mat noise(48, 80, CV_8U);
    cv::RNG(7).fill(noise, cv::RNG::UNIFORM, 0, 256);
    const cv::Mat left = noise.colRange(0, 64).clone(), near = noise.colRange(8, 72).clone(),
                  far = noise.colRange(4, 68).clone();
    const cv::Mat before = meter->depth_of(frame_of(left, near, 0)).clone();
    CHECK(cv::countNonZero(before) > 500);
    CHECK(cv::norm(before, meter->depth_of(frame_of(left, far, 1)), cv::NORM_INF) == 0);
}
