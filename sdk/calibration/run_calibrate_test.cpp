// `defrec calibrate`: rendered boards, whose cameras are known.
#include "sdk/calibration/run_calibrate.hpp"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "sdk/calibration/test_board.hpp"
#include "sdk/io/calibration.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec;
using namespace defrec::cli;

namespace {

constexpr int kFrames = 36;
constexpr double kTilt = 0.6, kMarker = 3;

const TestFilm& chessboard() {
    static const TestFilm film = film_of(TestRig(), TestBoard(), kFrames, kTilt);
    return film;
}

// Its first frames, with pixels of their own.
TestFilm chessboard(std::size_t count) {
    TestFilm film;
    for (std::size_t i = 0; i < count; ++i) {
        film.left.push_back(chessboard().left[i].clone());
        film.right.push_back(chessboard().right[i].clone());
    }
    return film;
}

CalibrateCommand command_in(const TestFolder& folder, const TestFilm& film) {
    write_images(folder / "left", film.left);
    write_images(folder / "right", film.right);
    CalibrateCommand command;
    command.source.left = folder / "left";
    command.source.right = folder / "right";
    command.source.fields = FieldOrder::kAuto;
    command.board.across = 10;
    command.board.down = 7;
    command.board.square_mm = 4;
    command.out = folder / "calibration.yaml";
    command.quiet = true;
    return command;
}

// What a run says where it ends with `code`.
std::string refused(const CalibrateCommand& command, ExitCode code = ExitCode::kInput) {
    try {
        run_calibrate(command);
    } catch (const CliError& error) {
        return error.code() == code ? error.what() : std::string("another code: ") + error.what();
    }
    return "accepted";
}

cv::Matx33d matrix_of(const CameraCalibration& camera) {
    return {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
}

// How far rows of points in the working volume disagree once both views are rectified by the
// calibration, px: root mean square and largest.
struct Rows {
    double rms = 0, most = 0;
};
Rows rows_by(const TestRig& rig, const StereoCalibration& found) {
    std::vector<cv::Point3d> left, right;
    for (double z = 50; z <= 100; z += 10)
        for (double y = -0.38; y <= 0.38; y += 0.04)
            for (double x = -0.5; x <= 0.5; x += 0.05) {
                const cv::Vec3d at(x * z, y * z, z);
                const cv::Vec3d there = rig.rotation * at + rig.translation;
                left.emplace_back(at);
                right.emplace_back(there);
            }
    std::vector<cv::Point2d> pixels[2];
    const cv::Vec3d none;
    cv::projectPoints(left, none, none, rig.left.matrix, rig.left.distortion, pixels[0]);
    cv::projectPoints(right, none, none, rig.right.matrix, rig.right.distortion, pixels[1]);
    cv::Mat r1, r2, p1, p2, q;
    const cv::Matx33d m1 = matrix_of(found.left), m2 = matrix_of(found.right),
                      r(found.rotation.data());
    const cv::Vec3d t(found.translation.data());
    cv::stereoRectify(m1, found.left.distortion, m2, found.right.distortion, rig.size, r, t, r1, r2,
                      p1, p2, q);
    std::vector<cv::Point2d> rectified[2];
    cv::undistortPoints(pixels[0], rectified[0], m1, found.left.distortion, r1, p1);
    cv::undistortPoints(pixels[1], rectified[1], m2, found.right.distortion, r2, p2);
    Rows rows;
    double sum = 0;
    int count = 0;
    const cv::Rect2d image(0, 0, rig.size.width - 1, rig.size.height - 1);
    for (std::size_t i = 0; i < rectified[0].size(); ++i) {
        if (!image.contains(pixels[0][i]) || !image.contains(pixels[1][i])) continue;
        const double row = rectified[0][i].y - rectified[1][i].y;
        sum += row * row;
        ++count;
        rows.most = std::max(rows.most, std::abs(row));
    }
    REQUIRE(count > 1000);
    rows.rms = std::sqrt(sum / count);
    return rows;
}

void check_calibration(const std::string& path) {
    const TestRig rig;
    const StereoCalibration found = load_calibration(path);
    CHECK(found.width == 640);
    CHECK(found.left.fx == doctest::Approx(560).epsilon(0.002));
    CHECK(found.left.fy == doctest::Approx(563).epsilon(0.002));
    CHECK(found.right.fx == doctest::Approx(566).epsilon(0.002));
    CHECK(found.right.fy == doctest::Approx(568).epsilon(0.002));
    CHECK(cv::norm(cv::Vec3d(found.translation.data()) - rig.translation) < 0.02);
    const Rows rows = rows_by(rig, found);
    CHECK(rows.rms < 0.1);
    CHECK(rows.most < 0.3);
}

}  // namespace

TEST_CASE("a chessboard: focal lengths to 0.2 %, rows to 0.1 px, and a report") {
    const TestFolder folder;
    CalibrateCommand command = command_in(folder, chessboard());
    command.report = folder / "report.json";
    REQUIRE(run_calibrate(command) == 0);
    check_calibration(command.out);
    const auto report = nlohmann::json::parse(TestFolder::read(command.report));
    CHECK(report["verdict"] == "accepted");
    CHECK(report["frames"]["searched"] == kFrames);
    CHECK(report["frames"]["used"].size() >= 20);
    CHECK(report["left"]["residual_px"] < 0.15);
    CHECK(report["left"]["coverage"] > 0.7);
    CHECK(report["rows"]["rms_px"] < 0.15);
    CHECK(report["max_tilt_degrees"] > 25);
    // z^2 / (f b) times the rows.
    const double z = report["at_distance"]["distance_mm"], rows = report["rows"]["rms_px"];
    CHECK(z > 60);
    CHECK(z < 100);
    CHECK(report["at_distance"]["expected_depth_error_mm"] ==
          doctest::Approx(rows * z * z / (563 * 4.6)).epsilon(0.1));
    CHECK(std::abs(static_cast<double>(report["board_in_space"]["length_error_share"])) < 0.003);
}

TEST_CASE("a ChArUco board in lossless videos") {
    TestFilm film = film_of(TestRig(), TestBoard::charuco(kMarker), kFrames, kTilt);
    const TestFolder folder;
    CalibrateCommand command = command_in(folder, film);
    command.board.kind = BoardKind::kCharuco;
    command.board.marker_mm = kMarker;
    REQUIRE(write_video(folder / "left.mkv", film.left));
    REQUIRE(write_video(folder / "right.mkv", film.right));
    command.source.left = folder / "left.mkv";
    command.source.right = folder / "right.mkv";
    REQUIRE(run_calibrate(command) == 0);
    check_calibration(command.out);

    // Both views mirrored: no marker is read, and why is said.
    for (std::vector<cv::Mat>* images : {&film.left, &film.right}) {
        images->resize(3);
        for (cv::Mat& image : *images) cv::flip(image.clone(), image, 1);
    }
    command = command_in(folder, film);
    command.board.kind = BoardKind::kCharuco;
    command.board.marker_mm = kMarker;
    CHECK_SAYS(refused(command), "The left view shows the board mirrored");
}

TEST_CASE("row 195: no board, another board, and squares counted wrongly are refused") {
    const TestFolder folder;
    TestFilm film = chessboard(3);
    CalibrateCommand command = command_in(folder, film);
    command.board.across = 9;
    command.board.down = 6;
    CHECK_SAYS(refused(command), "squares are counted, not the corners");
    command.board.kind = BoardKind::kCharuco;
    command.board.marker_mm = kMarker;
    CHECK_SAYS(refused(command), "a ChArUco board with markers of");
    for (cv::Mat& image : film.right) image.setTo(90);
    command = command_in(folder, film);
    CHECK_SAYS(refused(command), "by the left one alone in 3");
    CHECK_FALSE(std::filesystem::exists(command.out));
}

TEST_CASE("row 196: one view mirrored, both mirrored, and views exchanged are refused") {
    const TestFolder folder;
    TestFilm film = chessboard(9);
    for (cv::Mat& image : film.right) cv::flip(image.clone(), image, 1);
    CalibrateFindings findings = calibrate(command_in(folder, film));
    REQUIRE_FALSE(findings.faults.empty());
    CHECK_SAYS(findings.faults.front(), "one view is mirrored against the other");

    CalibrateCommand command = command_in(folder, chessboard());
    std::swap(command.source.left, command.source.right);
    command.report = folder / "report.json";
    CHECK(run_calibrate(command) == 9);
    CHECK_FALSE(std::filesystem::exists(command.out));
    const auto report = nlohmann::json::parse(TestFolder::read(command.report));
    CHECK(report["verdict"] == "refused");
    REQUIRE(report["faults"].size() == 1);
    CHECK_SAYS(report["faults"][0].get<std::string>(),
               "left and right are exchanged, or both views are mirrored");
}

TEST_CASE("row 197: too few poses, and boards that all face the camera are refused") {
    const TestFolder folder;
    TestFilm film;
    for (std::size_t i = 0; i < kFrames; ++i) {
        film.left.push_back(chessboard().left[i % 4]);
        film.right.push_back(chessboard().right[i % 4]);
    }
    CalibrateCommand command = command_in(folder, film);
    CHECK_SAYS(refused(command, ExitCode::kCalibration),
               "only 4 pairs of images show the board in poses of its own");

    command = command_in(folder, film_of(TestRig(), TestBoard(), 12, 0.02));
    const CalibrateFindings findings = calibrate(command);
    REQUIRE_FALSE(findings.faults.empty());
    CHECK_SAYS(findings.faults.back(), "tilt the board");
}

TEST_CASE("blurred frames and frames that do not fit are left out") {
    const TestFolder folder;
    TestFilm film = chessboard(20);
    for (const std::size_t i : {3U, 9U}) {
        cv::GaussianBlur(film.left[i].clone(), film.left[i], cv::Size(), 4);
        cv::GaussianBlur(film.right[i].clone(), film.right[i], cv::Size(), 4);
    }
    // The board moved between the times of both views.
    const cv::Matx23d shifted(1, 0, 0, 0, 1, 6);
    cv::warpAffine(film.right[12].clone(), film.right[12], shifted, film.right[12].size());
    const CalibrateFindings findings = calibrate(command_in(folder, film));
    CHECK(findings.is_accepted());
    CHECK(findings.solution.left_out >= 1);
    for (const std::size_t i : findings.solution.used)
        for (const std::int64_t bad : {3, 9, 12}) CHECK(findings.recording.frames[i].index != bad);
}

TEST_CASE("interlaced video is told") {
    const TestFolder folder;
    CalibrateCommand command = command_in(folder, chessboard(12));
    command.source.fields = FieldOrder::kTopFirst;
    const CalibrateFindings findings = calibrate(command);
    REQUIRE_FALSE(findings.warnings.empty());
    CHECK_SAYS(findings.warnings.front(), "the video is interlaced");
}

TEST_CASE("views of other times: the residual is said where too few frames fit a mirrored view") {
    const TestFolder folder;
    TestFilm film = chessboard(8);
    double shift = 8;
    for (cv::Mat& image : film.right) {
        const cv::Matx23d shifted(1, 0, 0, 0, 1, shift);
        cv::warpAffine(image.clone(), image, shifted, image.size());
        shift = -shift;
    }
    CalibrateCommand command = command_in(folder, film);
    command.report = folder / "report.json";
    CHECK(run_calibrate(command) == 9);
    const auto report = nlohmann::json::parse(TestFolder::read(command.report));
    REQUIRE(report["faults"].size() >= 1);
    CHECK_SAYS(report["faults"][0].get<std::string>(), "the views were not taken at the same time");
}

TEST_CASE("exit code 2: boards that there cannot be, an output that is an input") {
    const TestFolder folder;
    CalibrateCommand command = command_in(folder, chessboard(1));
    const std::string out = std::exchange(command.out, folder.write("times.csv", "time_ms\n0\n"));
    command.source.times = command.out;
    CHECK_SAYS(refused(command, ExitCode::kUsage), "times.csv");
    command.source.times.clear();
    command.source.recording = command.out;
    CHECK_SAYS(refused(command, ExitCode::kUsage), "times.csv");
    command.source.recording.clear();
    command.out = out;
    command.board.across = 3;
    CHECK_SAYS(refused(command, ExitCode::kUsage), "has too few inner corners");
    command.board.across = 30;
    command.board.kind = BoardKind::kCharuco;
    CHECK_SAYS(refused(command, ExitCode::kUsage), "markers that are smaller than its squares");
    command.board.marker_mm = kMarker;
    CHECK_SAYS(refused(command, ExitCode::kUsage),
               "4x4_50 has 50 markers; a board of 30x7 squares has 105");
}
