// What `defrec calibrate` says.
#include <nlohmann/json.hpp>

#include "sdk/calibration/run_calibrate.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

Json numbers(const cv::Mat& matrix) {
    Json made = Json::array();
    for (int row = 0; row < matrix.rows; ++row)
        for (int column = 0; column < matrix.cols; ++column)
            made.push_back(matrix.at<double>(row, column));
    return made;
}

Json view_json(const ViewSolution& view) {
    return {{"matrix", numbers(view.matrix)},  {"distortion", numbers(view.distortion)},
            {"residual_px", view.residual_px}, {"focal_error_share", view.focal_error},
            {"coverage", view.coverage},       {"missed", view.missed}};
}

std::string percent(double share, int digits) { return format_fixed(100 * share, digits) + " %"; }

std::string view_text(const char* name, const ViewSolution& view) {
    std::string text = std::string(name) + ": residual " + format_fixed(view.residual_px, 3) +
                       " px; focal length " + format_fixed(view.matrix.at<double>(0, 0), 1) +
                       " px, standard deviation " + percent(view.focal_error, 2) +
                       "; boards reached " + percent(view.coverage, 0) + " of the image";
    for (std::size_t i = 0; i < view.missed.size(); ++i)
        text += (i == 0 ? ", not " : ", ") + view.missed[i];
    return text + "\n";
}

}  // namespace

Json calibrate_json(const CalibrateFindings& findings) {
    const BoardRecording& recording = findings.recording;
    const StereoSolution& solution = findings.solution;
    Json made;
    made["verdict"] = findings.is_accepted() ? "accepted" : "refused";
    made["faults"] = findings.faults;
    made["warnings"] = findings.warnings;
    made["width"] = recording.size.width;
    made["height"] = recording.size.height;
    made["frames"] = {{"searched", recording.searched},   {"with_board", recording.frames.size()},
                      {"only_left", recording.only_left}, {"only_right", recording.only_right},
                      {"left_out", solution.left_out},    {"used", Json::array()}};
    for (std::size_t i = 0; i < solution.used.size(); ++i)
        made["frames"]["used"].push_back({{"frame", recording.frames[solution.used[i]].index},
                                          {"residual_px", solution.frame_px[i]}});
    made["left"] = view_json(solution.left);
    made["right"] = view_json(solution.right);
    made["rotation"] = numbers(solution.rotation);
    made["translation_mm"] = numbers(solution.translation);
    made["baseline_mm"] = solution.baseline_mm();
    made["max_tilt_degrees"] = solution.max_tilt_degrees;
    made["rows"] = {{"rms_px", solution.rows_px},
                    {"bias_px", solution.rows_bias_px},
                    {"bias_region", solution.rows_region}};
    made["at_distance"] = {{"distance_mm", solution.distance_mm},
                           {"expected_depth_error_mm", solution.depth_error_mm},
                           {"depth_bias_mm", solution.depth_bias_mm}};
    made["board_in_space"] = {{"shape_error_mm", solution.shape_error_mm},
                              {"length_error_share", solution.length_error}};
    return made;
}

std::string calibrate_text(const CalibrateFindings& findings) {
    const BoardRecording& recording = findings.recording;
    const StereoSolution& solution = findings.solution;
    std::string text = std::to_string(solution.used.size()) + " pairs used of " +
                       std::to_string(recording.frames.size()) + " with the board in " +
                       std::to_string(recording.searched) + " frames";
    text += solution.left_out > 0
                ? ", " + std::to_string(solution.left_out) + " left out that did not fit\n"
                : "\n";
    text += view_text("left", solution.left) + view_text("right", solution.right);
    text += "baseline: " + format_fixed(solution.baseline_mm(), 3) + " mm\n";
    text += "rows: " + format_fixed(solution.rows_px, 3) + " px between the views, up to " +
            format_fixed(solution.rows_bias_px, 3) + " px of it lasting, " + solution.rows_region +
            "\n";
    text += "at " + format_fixed(solution.distance_mm, 0) + " mm: depth to " +
            format_fixed(solution.depth_error_mm, 2) + " mm by a single pixel, off by up to " +
            format_fixed(solution.depth_bias_mm, 2) + " mm over a region\n";
    text += "board in space: shape to " + format_fixed(solution.shape_error_mm, 3) +
            " mm, lengths to " + percent(solution.length_error, 2) + "\n";
    for (const std::string& warning : findings.warnings) text += "warning: " + warning + "\n";
    for (const std::string& fault : findings.faults) text += "refused: " + fault + "\n";
    return text;
}

}  // namespace defrec::cli
