// See run_calibrate.hpp.
#include "sdk/calibration/run_calibrate.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/calibration/decisions.hpp"
#include "sdk/io/calibration.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using decisions::BoardVerdict;

CameraCalibration camera_of(const ViewSolution& view, const char* name) {
    CameraCalibration made;
    made.fx = view.matrix.at<double>(0, 0);
    made.fy = view.matrix.at<double>(1, 1);
    made.cx = view.matrix.at<double>(0, 2);
    made.cy = view.matrix.at<double>(1, 2);
    for (int i = 0; i < static_cast<int>(view.distortion.total()); ++i)
        made.distortion.push_back(view.distortion.at<double>(i));
    made.matrix_origin = std::string("the camera matrix of the ") + name + " view";
    made.distortion_origin = std::string("the distortion of the ") + name + " view";
    return made;
}

// Whether `track` would take it; empty: it would.
std::string refusal_of(const CalibrateFindings& findings) {
    const StereoSolution& solution = findings.solution;
    StereoCalibration made;
    made.width = findings.recording.size.width;
    made.height = findings.recording.size.height;
    made.left = camera_of(solution.left, "left");
    made.right = camera_of(solution.right, "right");
    for (int i = 0; i < 9; ++i)
        made.rotation[static_cast<std::size_t>(i)] = solution.rotation.at<double>(i / 3, i % 3);
    for (int i = 0; i < 3; ++i)
        made.translation[static_cast<std::size_t>(i)] = solution.translation.at<double>(i);
    made.size_origin = made.rotation_origin = made.translation_origin = "calibration";
    try {
        detail::check_and_normalise(made, LengthUnit::kMillimetre, LengthUnit::kMillimetre);
        fit_to_frames(made, made.width, made.height);
    } catch (const CliError& error) {
        return error.what();
    }
    return "";
}

double residual_px(const StereoSolution& solution) {
    return std::max(solution.left.residual_px, solution.right.residual_px);
}

// The recording if the right view were mirrored: a chessboard is then one again, whose columns are
// counted from the other side.
BoardRecording with_mirrored_right(BoardRecording recording, int columns) {
    for (BoardFrame& frame : recording.frames) {
        std::vector<cv::Point2f>& corners = frame.right.corners;
        for (cv::Point2f& corner : corners)
            corner.x = static_cast<float>(recording.size.width - 1) - corner.x;
        for (auto row = corners.begin(); row != corners.end(); row += columns)
            std::reverse(row, row + columns);
        turn_alike(frame.left, frame.right);
    }
    return recording;
}

bool is_mirrored(const CalibrateCommand& command, const BoardFinder& finder,
                 const CalibrateFindings& findings) {
    if (command.board.kind != BoardKind::kChessboard) return false;
    try {
        const StereoSolution other =
            solve_stereo(finder, with_mirrored_right(findings.recording, command.board.across - 1),
                         findings.solution.used, command.coefficients, command.distance_mm);
        return residual_px(other) < residual_px(findings.solution) / 2;
    } catch (const CliError&) {  // too few frames fit a mirrored view
    } catch (const cv::Exception&) {
    }
    return false;
}

void judge_fit(const CalibrateCommand& command, const BoardFinder& finder,
               CalibrateFindings& findings) {
    const StereoSolution& solution = findings.solution;
    const double residual = residual_px(solution);
    std::vector<std::string>& faults = findings.faults;
    if (residual > BoardVerdict::kMaxResidual)
        faults.push_back(
            "the residual is " + format_fixed(residual, 2) + " px, expected at most " +
            format_fixed(BoardVerdict::kMaxResidual, 1) +
            (is_mirrored(command, finder, findings)
                 ? ": one view is mirrored against the other; mirror it, here and where it is "
                   "tracked."
                 : ": the views were not taken at the same time, the board is not flat, or the "
                   "lens needs more coefficients (--coefficients 8)."));
    else if (solution.rows_px > BoardVerdict::kMaxRows)
        faults.push_back("rows of both views disagree by " + format_fixed(solution.rows_px, 2) +
                         " px, expected at most " + format_fixed(BoardVerdict::kMaxRows, 1) +
                         ": hold the board still in each pair.");
    const double focal = std::max(solution.left.focal_error, solution.right.focal_error);
    if (focal > BoardVerdict::kMaxFocalError)
        faults.push_back("the focal length is known to " + format_fixed(100 * focal, 1) +
                         " %, expected " + format_fixed(100 * BoardVerdict::kMaxFocalError, 0) +
                         ": tilt the board by 20 to 45 degrees to each side.");
    if (solution.translation.at<double>(0) > 0)
        faults.emplace_back(
            "the right camera stands on the left: left and right are exchanged, or both views are "
            "mirrored.");
    else if (faults.empty()) {
        const std::string refusal = refusal_of(findings);
        if (!refusal.empty()) faults.push_back(refusal);
    }
}

void warn(CalibrateFindings& findings) {
    const StereoSolution& solution = findings.solution;
    std::vector<std::string>& warnings = findings.warnings;
    if (is_interlaced(findings.recording.fields))
        warnings.emplace_back(
            "the video is interlaced: each field was a frame, its other rows were made of it. Keep "
            "the board still, and track with the same --interlaced.");
    for (const auto& [name, view] :
         {std::pair("left", &solution.left), std::pair("right", &solution.right)})
        if (view->coverage < BoardVerdict::kMinCoverage)
            warnings.push_back(std::string("boards reached ") +
                               format_fixed(100 * view->coverage, 0) + " % of the " + name +
                               " view; beyond them the distortion is guessed.");
    if (solution.max_tilt_degrees < BoardVerdict::kMinTilt)
        warnings.push_back("no board was tilted by more than " +
                           format_fixed(solution.max_tilt_degrees, 0) +
                           " degrees; focal length and distance are then hard to tell apart.");
}

// OpenCV's stereo YAML.
std::string yaml_of(const CalibrateFindings& findings) {
    const StereoSolution& solution = findings.solution;
    cv::FileStorage file(".yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
    file << "image_width" << findings.recording.size.width << "image_height"
         << findings.recording.size.height << "M1" << solution.left.matrix << "D1"
         << solution.left.distortion << "M2" << solution.right.matrix << "D2"
         << solution.right.distortion << "R" << solution.rotation << "T" << solution.translation;
    return file.releaseAndGetString();
}

}  // namespace

CalibrateFindings calibrate(const CalibrateCommand& command) {
    const BoardFinder finder(command.board);
    CalibrateFindings findings;
    findings.recording = find_boards(command.source, finder, command.quiet);
    findings.solution =
        solve_stereo(finder, findings.recording, choose_frames(finder, findings.recording),
                     command.coefficients, command.distance_mm);
    judge_fit(command, finder, findings);
    warn(findings);
    return findings;
}

int run_calibrate(const CalibrateCommand& command) {
    const SourceOptions& source = command.source;
    keep_apart(
        {source.left, source.right, source.stereo, source.bag.path, source.times, source.recording},
        {command.out, command.report});
    const CalibrateFindings findings = calibrate(command);
    const std::string json = json_text(calibrate_json(findings), 2) + "\n";
    if (!command.report.empty()) write_atomically(command.report, json);
    if (findings.is_accepted()) write_atomically(command.out, yaml_of(findings));
    if (!command.quiet) print(command.json ? json : calibrate_text(findings));
    return static_cast<int>(findings.is_accepted() ? ExitCode::kOk : ExitCode::kFound);
}

}  // namespace defrec::cli
