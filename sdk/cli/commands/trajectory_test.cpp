// The camera's trajectory of a run against the one that was rendered.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "sdk/cli/commands/test_run.hpp"
#include "sdk/hand_eye/program/pose_file.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/scenes/writing/test_sequence.hpp"

using namespace defrec::cli;

namespace {

constexpr int kFrames = 16, kDark = 9;  // the second: a frame without light
constexpr double kFps = 25;

// Places of one rigid body by frame, in the camera of that frame, mm.
std::map<std::int64_t, std::vector<Eigen::Vector3d>> places_of(const std::string& truth) {
    std::map<std::int64_t, std::vector<Eigen::Vector3d>> places;
    CsvReader csv(truth, {"frame", "x", "y", "z"});
    while (csv.next())
        places[csv.integer(0)].emplace_back(csv.number(1), csv.number(2), csv.number(3));
    return places;
}

Eigen::Isometry3d pose_between(const std::vector<Eigen::Vector3d>& first,
                               const std::vector<Eigen::Vector3d>& now) {
    const auto count = static_cast<Eigen::Index>(first.size());
    const Eigen::Map<const Eigen::Matrix3Xd> to(first.front().data(), 3, count);
    const Eigen::Map<const Eigen::Matrix3Xd> from(now.front().data(), 3, count);
    return Eigen::Isometry3d(Eigen::umeyama(from, to, false));
}

Eigen::Isometry3d pose_at(const PoseFile& file, std::size_t index) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.matrix().topRows<3>() =
        Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(&file.poses[12 * index]);
    return pose;
}

}  // namespace

TEST_CASE("trajectory.txt is the rendered camera's way, without the frames in which it is lost") {
    const TestFolder input;
    RenderOptions render;
    render.scene = "body-rigid";
    render.settings = {{"camera", 2}};
    render.out_dir = input.path().string();
    render.width = 320;
    render.height = 240;
    render.frames = kFrames;
    render_sequence(render, {});
    for (const char* view : {"left", "right"})
        cv::imwrite(images_of(input / view)[kDark].string(), cv::Mat::zeros(240, 320, CV_8UC3));
    const std::string out = input / "out";
    REQUIRE(run({"track", "--quiet", "--no-overlay", "--left", input / "left", "--right",
                 input / "right", "--calibration", input / "calibration.yaml", "--fps", "25",
                 "--out", out}) == 0);

    const PoseFile file = read_timed_poses(out + "/trajectory.txt", std::nullopt, true);
    CHECK(file.is_tum);
    REQUIRE(file.count() == kFrames - 1);
    const auto truth = places_of(input / "truth_deep.csv");
    double largest_mm = 0, largest_degrees = 0, way_mm = 0, way_degrees = 0;
    for (std::size_t i = 0; i < file.count(); ++i) {
        const std::int64_t frame = std::llround(file.times_s[i] * kFps);
        CHECK(frame != kDark);
        CHECK(file.times_s[i] == doctest::Approx(static_cast<double>(frame) / kFps));
        const Eigen::Isometry3d expected = pose_between(truth.at(0), truth.at(frame));
        const Eigen::Isometry3d off = expected.inverse() * pose_at(file, i);
        const auto degrees = [](const Eigen::Isometry3d& pose) {
            return Eigen::AngleAxisd(pose.rotation()).angle() * 180 / M_PI;
        };
        largest_mm = std::max(largest_mm, off.translation().norm());
        largest_degrees = std::max(largest_degrees, degrees(off));
        way_mm = std::max(way_mm, expected.translation().norm());
        way_degrees = std::max(way_degrees, degrees(expected));
    }
    MESSAGE("off by " << largest_mm << " mm and " << largest_degrees << " degrees, on a way of "
                      << way_mm << " mm and " << way_degrees << " degrees");
    CHECK(way_mm > 4);
    CHECK(way_degrees > 3);
    // The camera is 90 mm away: 0.5 degrees are 0.8 mm.
    CHECK(largest_mm < 1);
    CHECK(largest_degrees < 0.6);
}
