// StereoMIS: metrics by hand, rendered data in, malformed copies.
#include <cmath>
#include <opencv2/core.hpp>
#include <sstream>

#include "sdk/evaluation/data_sets/trajectory_metrics.hpp"
#include "sdk/evaluation/layout_test.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 16;

const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made = (render_layout_to(folder.path(), "slide", "stereomis", kFrames, 320,
                                                  240, {{"period", 30}, {"distance", 40}}),
                                 true);
    static_cast<void>(is_made);
    return folder;
}

cv::Matx33d turn_about_z(double degrees) {
    const double c = std::cos(degrees * CV_PI / 180), s = std::sin(degrees * CV_PI / 180);
    return {c, -s, 0, s, c, 0, 0, 0, 1};
}

using Line = std::array<double, 8>;
std::vector<Line> read_lines(const fs::path& path) {
    std::istringstream text(TestFolder::read(path));
    std::vector<Line> lines;
    for (Line line; text >> line[0];) {
        for (std::size_t i = 1; i < line.size(); ++i) text >> line[i];
        lines.push_back(line);
    }
    return lines;
}

// Distances of the positions after the best shift and turn, mm; frames 1 to kFrames - 2.
double ate_of(const fs::path& truth, const fs::path& predicted) {
    const std::vector<Line> is = read_lines(truth), found = read_lines(predicted);
    REQUIRE(is.size() == kFrames);
    REQUIRE(found.size() == kFrames);
    std::vector<cv::Vec3d> from, to;
    for (std::size_t i = 1; i + 1 < kFrames; ++i) {
        CHECK(found[i][0] == static_cast<double>(i));
        from.emplace_back(found[i][1] * 1000, found[i][2] * 1000, found[i][3] * 1000);
        to.emplace_back(is[i][1] * 1000, is[i][2] * 1000, is[i][3] * 1000);
    }
    const Pose fit = rigid_fit(from, to, std::vector<double>(from.size(), 1));
    double squares = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
        const double distance = cv::norm(fit.rotation * from[i] + fit.position - to[i]);
        squares += distance * distance;
    }
    return std::sqrt(squares / static_cast<double>(from.size()));
}

}  // namespace

TEST_CASE("the rigid motion between points is found, and one that does not count is not followed") {
    const cv::Matx33d turn = turn_about_z(30);
    const cv::Vec3d shift(4, -2, 7);
    const std::vector<cv::Vec3d> from{{0, 0, 0}, {10, 0, 0}, {0, 5, 0}, {0, 0, 3}, {2, 2, 2}};
    std::vector<cv::Vec3d> to;
    for (const cv::Vec3d& point : from) to.push_back(turn * point + shift);
    to.back() = {100, 100, 100};
    const Pose pose = rigid_fit(from, to, {1, 1, 2, 1, 0});
    CHECK(cv::norm(pose.rotation - turn) < 1e-12);
    CHECK(cv::norm(pose.position - shift) < 1e-12);
    // A mirror image is met by no rotation: none is a reflection.
    const Pose mirrored = rigid_fit({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, -1, -1}},
                                    {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {-1, -1, 1}}, {1, 1, 1, 1});
    CHECK(cv::determinant(mirrored.rotation) == doctest::Approx(1));
}

TEST_CASE("errors of trajectories by hand") {
    std::vector<Pose> truth, predicted;
    const Pose elsewhere{turn_about_z(90), {100, 0, 0}};
    for (int i = 0; i < 4; ++i) {
        truth.push_back({turn_about_z(5 * i), {10.0 * i, i == 2 ? 4.0 : 0.0, 0}});
        predicted.push_back(elsewhere * truth.back());
    }
    for (const double error : absolute_errors(truth, predicted)) CHECK(error < 1e-9);
    for (const MotionError& error : relative_errors(truth, predicted)) {
        CHECK(error.mm < 1e-9);
        CHECK(error.degrees < 1e-5);  // the arc cosine of almost 1
    }
    // Two positions 10 mm apart, predicted 13 mm apart: after the fit each is off by half of 3 mm.
    truth = {{}, {{}, {10, 0, 0}}};
    for (Pose& pose : truth) pose.rotation = cv::Matx33d::eye();
    predicted = truth;
    predicted[1].position[0] = 13;
    predicted[1].rotation = turn_about_z(7);
    const std::vector<double> absolute = absolute_errors(truth, predicted);
    CHECK(absolute[0] == doctest::Approx(1.5));
    CHECK(absolute[1] == doctest::Approx(1.5));
    const std::vector<MotionError> relative = relative_errors(truth, predicted);
    REQUIRE(relative.size() == 1);
    CHECK(relative[0].mm == doctest::Approx(3));
    CHECK(relative[0].degrees == doctest::Approx(7));
    CHECK(absolute_errors({}, {}).empty());
}

TEST_CASE("rendered data in, and the score is that of the trajectory that was written") {
    const TestFolder out;
    REQUIRE(evaluate_set("stereomis", data_set().path(), out.path()) == 0);
    const double ate = result_of(out.path(), "P1", "ate_rmse_mm");
    CHECK(ate == doctest::Approx(ate_of(data_set().path() / "P1/groundtruth.txt",
                                        out.path() / "clips/defrec/P1/trajectory_0.freiburg")));
    const auto truth = read_lines(data_set().path() / "P1/groundtruth.txt");
    const Line &from = truth[1], &to = truth[kFrames - 2];
    const double way = 1000 * std::hypot(to[1] - from[1], to[2] - from[2], to[3] - from[3]);
    CHECK(way > 30);         // mm
    CHECK(ate < 0.1 * way);  // the tissue beats by some mm
    CHECK(result_of(out.path(), "P1", "rpe_rot_deg") < 2);
    CHECK(result_of(out.path(), "P1", "posed_share") == 1);
}

TEST_CASE("truth that is moved changes the score as it must") {
    const TestFolder root, out, usual;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    const fs::path file = root.path() / "P1/groundtruth.txt";
    const auto write = [&](const std::vector<Line>& lines) {
        std::ofstream text(file);
        text.precision(17);
        text << "# t tx ty tz qx qy qz qw\n";
        for (const Line& line : lines) {
            for (std::size_t i = 0; i < line.size(); ++i) text << (i > 0 ? " " : "") << line[i];
            text << "\n";
        }
    };
    std::vector<Line> lines = read_lines(data_set().path() / "P1/groundtruth.txt");
    for (Line& line : lines) line[2] += 0.5;  // the whole trajectory by 500 mm
    write(lines);
    REQUIRE(evaluate_set("stereomis", root.path(), out.path()) == 0);
    REQUIRE(evaluate_set("stereomis", data_set().path(), usual.path()) == 0);
    for (const char* metric : {"ate_rmse_mm", "rpe_trans_mm", "rpe_rot_deg"}) {
        CHECK(result_of(out.path(), "P1", metric) ==
              doctest::Approx(result_of(usual.path(), "P1", metric)));
    }
    lines[4][3] += 0.03;  // one position by 30 mm
    write(lines);
    REQUIRE(evaluate_set("stereomis", root.path(), out.path()) == 0);
    // It alone is off by almost 30 mm, of the steps two, whose errors before were some mm at most.
    constexpr double kSteps = kFrames - 3;
    const auto more = [&](const char* metric) {
        return result_of(out.path(), "P1", metric) - result_of(usual.path(), "P1", metric);
    };
    CHECK(more("ate_rmse_mm") > 3);
    CHECK(more("rpe_trans_mm") > 2 * 24 / kSteps);
    CHECK(more("rpe_trans_mm") <= 2 * 30 / kSteps + 1e-6);
}

TEST_CASE("each line of a split is a trajectory of its own") {
    const TestFolder root, out;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    std::ofstream(root.path() / "P1/test_split.csv") << "start,end\n0,4\n5,9\n";
    REQUIRE(evaluate_set("stereomis", root.path(), out.path()) == 0);
    CHECK(read_lines(out.path() / "clips/defrec/P1/trajectory_0.freiburg").size() == 4);
    const auto second = read_lines(out.path() / "clips/defrec/P1/trajectory_5.freiburg");
    REQUIRE(second.size() == 4);
    CHECK(second[0][0] == 5);
    CHECK(second[0][7] == 1);  // where it begins
    CHECK(TestFolder::read(out.path() / "results.csv").find("defrec,P1,done,8,") !=
          std::string::npos);
}

TEST_CASE("what is not as expected is named") {
    BrokenCopies copies(data_set().path() / "P1");
    const auto replace = [&](const char* clip, const char* file, const std::string& from,
                             const std::string& to) {
        const fs::path path = copies.copy(clip) / file;
        std::string text = TestFolder::read(path);
        REQUIRE(text.find(from) != std::string::npos);
        std::ofstream(path) << text.replace(text.find(from), from.size(), to);
    };
    fs::remove(copies.copy("no_truth") / "groundtruth.txt");
    fs::remove(copies.copy("no_video") / "P1.mp4");
    fs::copy(data_set().path() / "P1/P1.mp4", copies.copy("two_videos") / "P2.mp4");
    replace("no_focus", "StereoCalibration.ini", "fc_y=", "f_y=");
    replace("no_right", "StereoCalibration.ini", "[StereoRight]", "[Right]");
    replace("other_size", "StereoCalibration.ini", "res_x=320", "res_x=640");
    replace("short_line", "groundtruth.txt", "\n2 ", "\n");
    std::ofstream(copies.copy("few_poses") / "groundtruth.txt") << "0 0 0 0 0 0 0 1\n";
    std::ofstream(copies.copy("odd_split") / "test_split.csv") << "start,end\n4,4\n";
    std::ofstream(copies.copy("no_split") / "test_split.csv") << "start\n4\n";
    copies.evaluate("stereomis");
    copies.says("no_truth", "groundtruth.txt: this file was expected: t tx ty tz qx qy qz qw");
    copies.says("no_video", "one file *.mp4; a video of both views; the left one on top");
    copies.says("two_videos", "there are 2");
    copies.says("no_focus", "StereoCalibration.ini: [StereoLeft]: fc_y; a number; was expected");
    copies.says("no_right", "[StereoRight]: fc_x; a number; was expected");
    copies.says("other_size", "640");
    copies.says("short_line", "groundtruth.txt:3: t tx ty tz qx qy qz qw");
    copies.says("few_poses", "a pose for each of the frames 0 to 15 was expected; there are 1");
    copies.says("odd_split", "test_split.csv:2:");
    copies.says("no_split", "end");
}
