// See hand_eye_json.hpp.
#include "sdk/hand_eye/program/hand_eye_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "sdk/io/text.hpp"
#include "sdk/registration/pose.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegree = std::numbers::pi / 180;

// What is not finite is null.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json rows(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
    Json made = Json::array();
    for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
        Json line = Json::array();
        for (Eigen::Index column = 0; column < matrix.cols(); ++column)
            line.push_back(number(matrix(row, column)));
        made.push_back(std::move(line));
    }
    return made;
}

Json open_json(const HandEyeOpenMotion& open) {
    Json made;
    made["kind"] = open.is_turn ? "turn" : "shift";
    made["axis"] = {open.axis.x(), open.axis.y(), open.axis.z()};
    made[open.is_turn ? "expected_degrees" : "expected_mm"] =
        open.is_turn ? open.expected / kDegree : open.expected;
    made["text"] = open.text();
    return made;
}

Json quality_json(const HandEyeQuality& quality) {
    Json made;
    made["rms_mm"] = quality.rms_mm;
    made["rms_degrees"] = quality.rms_rad / kDegree;
    made["error_ratio"] = quality.error_ratio;
    made["poses"] = quality.poses;
    made["fit"] = quality.inliers;
    made["correlated"] = quality.correlated;
    made["camera_error_mm"] = quality.noise.camera_mm;
    made["camera_error_degrees"] = quality.noise.camera_rad / kDegree;
    made["tracker_error_mm"] = quality.noise.tracker_mm;
    made["tracker_error_degrees"] = quality.noise.tracker_rad / kDegree;
    return made;
}

Json poses_json(const HandEyeCalibration& calibration) {
    Json made = Json::array();
    for (std::size_t i = 0; i < calibration.residual_mm.size(); ++i)
        made.push_back({{"pose", i},
                        {"residual_mm", number(calibration.residual_mm[i])},
                        {"residual_degrees", number(calibration.residual_rad[i] / kDegree)},
                        {"fits", calibration.is_inlier[i] != 0}});
    return made;
}

}  // namespace

Json hand_eye_json(const HandEyeCalibration& calibration) {
    const HandEyeQuality& quality = calibration.quality;
    Json made;
    made["verdict"] = name_of(calibration.verdict);
    made["reason"] = calibration.reason;
    const bool is_computed = !calibration.residual_mm.empty();
    const auto if_computed = [&](const auto& matrix) {
        return is_computed ? rows(matrix) : Json();
    };
    made["marker_from_camera"] = if_computed(calibration.transforms.marker_from_camera.matrix());
    made["tracker_from_world"] = if_computed(calibration.transforms.tracker_from_world.matrix());
    made["covariance"] = if_computed(calibration.covariance);
    made["covariance_of"] =
        "turn in rad about x, y, z, then shift in mm, of a motion of the marker's frame about its "
        "origin after marker_from_camera";
    made["undetermined"] = Json::array();
    for (const HandEyeOpenMotion& open : calibration.open)
        made["undetermined"].push_back(open_json(open));
    made["offset"] = {{"estimated", calibration.offset.is_estimated},
                      {"offset_s", calibration.offset.offset_s},
                      {"sigma_s", number(calibration.offset.sigma_s)},
                      {"correlation", calibration.offset.correlation}};
    made["residuals"] = quality_json(quality);
    made["motion"] = {{"turn_degrees", quality.turn_rad / kDegree},
                      {"cross_turn_degrees", quality.cross_turn_rad / kDegree}};
    made["length_factor"] = number(quality.length_factor);
    made["length_factor_sigma"] = number(quality.length_factor_sigma);
    made["poses"] = poses_json(calibration);
    made["notes"] = calibration.notes;
    return made;
}

std::string hand_eye_text(const HandEyeCalibration& calibration) {
    constexpr int kDigits = 3, kTimeDigits = 1;
    std::string text =
        std::string(name_of(calibration.verdict)) + ": " + calibration.reason + ".\n";
    const HandEyeQuality& quality = calibration.quality;
    if (!calibration.residual_mm.empty()) {
        text += "residuals: " + format_fixed(quality.rms_mm, kDigits) + " mm, " +
                format_fixed(quality.rms_rad / kDegree, kDigits) + " degrees; " +
                std::to_string(quality.inliers) + " of " + std::to_string(quality.poses) +
                " poses fit\n";
        const Eigen::Vector3d place = calibration.transforms.marker_from_camera.translation();
        const Eigen::Matrix<double, 3, 6> shift = place_shift(place);
        const Eigen::Matrix3d covariance = shift * calibration.covariance * shift.transpose();
        text +=
            "camera in the marker's frame: " + format_fixed(place.x(), kDigits) + " " +
            format_fixed(place.y(), kDigits) + " " + format_fixed(place.z(), kDigits) +
            " mm, standard deviation " + format_fixed(std::sqrt(covariance.trace()), kDigits) +
            " mm and " +
            format_fixed(std::sqrt(calibration.covariance.topLeftCorner<3, 3>().trace()) / kDegree,
                         kDigits) +
            " degrees\n";
    }
    if (calibration.offset.is_estimated)
        text += "tracker's time = camera's time + " +
                format_fixed(1000 * calibration.offset.offset_s, kTimeDigits) +
                " ms, standard deviation " +
                format_fixed(1000 * calibration.offset.sigma_s, kDigits) + " ms\n";
    for (const std::string& note : calibration.notes) text += "note: " + note + "\n";
    return text;
}

}  // namespace defrec::cli
