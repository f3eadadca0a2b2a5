// See register_json.hpp.
#include "sdk/registration/program/register_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

Json numbers(const Eigen::Vector3d& values) {
    Json made = Json::array();
    for (const double value : values) made.push_back(value);
    return made;
}

Json rows(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
    Json made = Json::array();
    for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
        Json line = Json::array();
        for (Eigen::Index column = 0; column < matrix.cols(); ++column)
            line.push_back(matrix(row, column));
        made.push_back(std::move(line));
    }
    return made;
}

Json transform(const Pose& pose) {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    matrix.topLeftCorner<3, 3>() = pose.rotation;
    matrix.topRightCorner<3, 1>() = pose.translation;
    return rows(matrix);
}

Json free_motion(const FreeMotion& motion) {
    Json made;
    made["kind"] = motion.is_turn ? "turn" : "shift";
    made["axis"] = numbers(motion.axis);
    if (motion.is_turn) {
        made["point"] = numbers(motion.point);
        made["pitch_mm_per_rad"] = motion.pitch_mm;
    }
    made["expected_mm"] = motion.expected_mm;
    made["text"] = motion.text();
    return made;
}

double expected_error(const Eigen::Matrix3d& covariance) { return std::sqrt(covariance.trace()); }

Json target_json(const Registration& registration, const ModelTarget& target) {
    const Eigen::Matrix3d covariance = registration.target_covariance(target.place);
    Json made;
    made["name"] = target.name;
    made["model"] = numbers(target.place);
    made["position"] = numbers(registration.pose * target.place);
    made["expected_error_mm"] = expected_error(covariance);
    made["covariance_mm2"] = rows(covariance);
    return made;
}

Json residuals_json(const RegistrationResiduals& residuals) {
    return {{"rms_mm", residuals.rms_mm},           {"robust_mm", residuals.robust_mm},
            {"error_ratio", residuals.error_ratio}, {"inlier_share", residuals.inlier_share},
            {"correlated", residuals.correlated},   {"used", residuals.used}};
}

}  // namespace

Json register_json(const RegisterFindings& findings) {
    const Registration& registration = findings.registration;
    Json made;
    made["verdict"] = name_of(registration.verdict);
    made["reason"] = registration.reason;
    made["method"] = findings.method;
    made["transform"] = transform(registration.pose);
    made["covariance"] = rows(registration.covariance);
    made["covariance_of"] =
        "turn in rad about x, y, z, then shift in mm, of a motion of the surface's frame about its "
        "origin after the transform";
    made["undetermined"] = Json::array();
    for (const FreeMotion& motion : registration.free)
        made["undetermined"].push_back(free_motion(motion));
    made["residuals"] = residuals_json(registration.residuals);
    made["pairs"] = Json::array();
    for (std::size_t i = 0; i < findings.pair_ids.size(); ++i)
        made["pairs"].push_back({{"id", findings.pair_ids[i]},
                                 {"residual_mm", registration.residual_mm[i]},
                                 {"fits", registration.is_inlier[i] != 0}});
    made["alternatives"] = Json::array();
    for (const RegistrationAlternative& other : registration.alternatives)
        made["alternatives"].push_back({{"transform", transform(other.pose)},
                                        {"distance_mm", other.distance_mm},
                                        {"rms_mm", other.rms_mm},
                                        {"inlier_share", other.inlier_share}});
    made["targets"] = Json::array();
    for (const ModelTarget& target : findings.targets)
        made["targets"].push_back(target_json(registration, target));
    made["notes"] = findings.notes;
    return made;
}

std::string register_text(const RegisterFindings& findings) {
    const Registration& registration = findings.registration;
    std::string text =
        std::string(name_of(registration.verdict)) + ": " + registration.reason + "\n";
    for (const std::string& note : findings.notes) text += "note: " + note + "\n";
    constexpr std::size_t kMostShown = 10;
    for (std::size_t i = 0; i < findings.targets.size() && i < kMostShown; ++i) {
        const ModelTarget& target = findings.targets[i];
        const Eigen::Vector3d place = registration.pose * target.place;
        text +=
            "target " + printable(target.name) + ": " + format_fixed(place.x(), 2) + " " +
            format_fixed(place.y(), 2) + " " + format_fixed(place.z(), 2) + " mm, expected error " +
            format_fixed(expected_error(registration.target_covariance(target.place)), 2) + " mm\n";
    }
    if (findings.targets.size() > kMostShown)
        text += "... and " + std::to_string(findings.targets.size() - kMostShown) +
                " more in registration.json\n";
    return text;
}

}  // namespace defrec::cli
