// See hand_eye_json.hpp.
#include "sdk/hand_eye/program/hand_eye_json.hpp"

#include <Eigen/Core>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegree = std::numbers::pi / 180;

// What is not finite is null.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

// values: a matrix, row-major.
Json rows(const double* values, std::size_t height, std::size_t width) {
    Json made = Json::array();
    for (std::size_t row = 0; row < height; ++row) {
        Json line = Json::array();
        for (std::size_t column = 0; column < width; ++column)
            line.push_back(number(values[row * width + column]));
        made.push_back(std::move(line));
    }
    return made;
}

// The four rows of a rigid motion.
Json transform(const double* values) {
    Json made = rows(values, 3, 4);
    made.push_back({0.0, 0.0, 0.0, 1.0});
    return made;
}

const char* verdict_of(const HandEyeFindings& findings) {
    if (findings.is_solved()) return "solved";
    return findings.info.verdict == DEFREC_VERDICT_UNDETERMINED ? "undetermined" : "failed";
}

Json open_json(const HandEyeFindings& findings, std::size_t index) {
    auto open = initialised<defrec_free_motion>();
    require(defrec_hand_eye_get_free_motion(findings.hand_eye.get(), index, &open),
            ExitCode::kInternal, "reading the result");
    const bool is_turn = open.kind == DEFREC_FREE_TURN;
    Json made;
    made["kind"] = is_turn ? "turn" : "shift";
    made["axis"] = {open.axis[0], open.axis[1], open.axis[2]};
    made[is_turn ? "expected_degrees" : "expected_mm"] =
        is_turn ? open.expected_rad / kDegree : open.expected_mm;
    made["text"] = open.text;
    return made;
}

Json quality_json(const defrec_hand_eye_info& info) {
    Json made;
    made["rms_mm"] = info.rms_mm;
    made["rms_degrees"] = info.rms_rad / kDegree;
    made["error_ratio"] = info.error_ratio;
    made["poses"] = info.used;
    made["fit"] = info.inlier_count;
    made["correlated"] = info.correlated;
    made["camera_error_mm"] = info.camera_error_mm;
    made["camera_error_degrees"] = info.camera_error_rad / kDegree;
    made["tracker_error_mm"] = info.tracker_error_mm;
    made["tracker_error_degrees"] = info.tracker_error_rad / kDegree;
    return made;
}

Json poses_json(const defrec_hand_eye_info& info) {
    Json made = Json::array();
    for (std::size_t i = 0; i < info.residual_count; ++i)
        made.push_back({{"pose", i},
                        {"residual_mm", number(info.residuals_mm[i])},
                        {"residual_degrees", number(info.residuals_rad[i] / kDegree)},
                        {"fits", info.inliers[i] != 0}});
    return made;
}

// The standard deviation of the camera's place, mm: J C J^T with J = [-[p]x 1].
double place_error(const defrec_hand_eye_info& info, const Eigen::Vector3d& p) {
    Eigen::Matrix<double, 3, 6> shift;
    shift << 0, p.z(), -p.y(), 1, 0, 0,  //
        -p.z(), 0, p.x(), 0, 1, 0,       //
        p.y(), -p.x(), 0, 0, 0, 1;
    using Covariance = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
    const Eigen::Map<const Covariance> covariance(info.covariance);
    return std::sqrt((shift * covariance * shift.transpose()).trace());
}

double turn_error(const defrec_hand_eye_info& info) {
    constexpr std::size_t kNext = 7;  // on the diagonal
    return std::sqrt(info.covariance[0] + info.covariance[kNext] + info.covariance[2 * kNext]);
}

}  // namespace

Json hand_eye_json(const HandEyeFindings& findings) {
    const defrec_hand_eye_info& info = findings.info;
    Json made;
    made["verdict"] = verdict_of(findings);
    made["reason"] = info.reason;
    const bool is_computed = info.is_solved != 0;
    made["marker_from_camera"] = is_computed ? transform(info.marker_from_camera) : Json();
    made["tracker_from_world"] = is_computed ? transform(info.tracker_from_world) : Json();
    made["covariance"] = is_computed ? rows(info.covariance, 6, 6) : Json();
    made["covariance_of"] =
        "turn in rad about x, y, z, then shift in mm, of a motion of the marker's frame about its "
        "origin after marker_from_camera";
    made["undetermined"] = Json::array();
    for (std::size_t i = 0; i < info.free_motion_count; ++i)
        made["undetermined"].push_back(open_json(findings, i));
    made["offset"] = {{"estimated", info.offset_estimated != 0},
                      {"offset_s", info.offset_s},
                      {"sigma_s", number(info.offset_sigma_s)},
                      {"correlation", info.offset_correlation}};
    made["residuals"] = quality_json(info);
    made["motion"] = {{"turn_degrees", info.turn_rad / kDegree},
                      {"cross_turn_degrees", info.cross_turn_rad / kDegree}};
    made["length_factor"] = number(info.length_factor);
    made["length_factor_sigma"] = number(info.length_factor_sigma);
    made["poses"] = poses_json(info);
    made["notes"] = findings.notes;
    return made;
}

std::string hand_eye_text(const HandEyeFindings& findings) {
    constexpr int kDigits = 3, kTimeDigits = 1;
    const defrec_hand_eye_info& info = findings.info;
    std::string text = std::string(verdict_of(findings)) + ": " + info.reason + ".\n";
    if (info.is_solved != 0) {
        text += "residuals: " + format_fixed(info.rms_mm, kDigits) + " mm, " +
                format_fixed(info.rms_rad / kDegree, kDigits) + " degrees; " +
                std::to_string(info.inlier_count) + " of " + std::to_string(info.used) +
                " poses fit\n";
        const Eigen::Vector3d place(info.marker_from_camera[3], info.marker_from_camera[7],
                                    info.marker_from_camera[11]);
        text += "camera in the marker's frame: " + format_fixed(place.x(), kDigits) + " " +
                format_fixed(place.y(), kDigits) + " " + format_fixed(place.z(), kDigits) +
                " mm, standard deviation " + format_fixed(place_error(info, place), kDigits) +
                " mm and " + format_fixed(turn_error(info) / kDegree, kDigits) + " degrees\n";
    }
    if (info.offset_estimated != 0)
        text += "tracker's time = camera's time + " +
                format_fixed(1000 * info.offset_s, kTimeDigits) + " ms, standard deviation " +
                format_fixed(1000 * info.offset_sigma_s, kDigits) + " ms\n";
    for (const std::string& note : findings.notes) text += "note: " + note + "\n";
    return text;
}

}  // namespace defrec::cli
