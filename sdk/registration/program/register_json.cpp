// See register_json.hpp.
#include "sdk/registration/program/register_json.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

Json numbers(const double* values, std::size_t count) {
    Json made = Json::array();
    for (std::size_t i = 0; i < count; ++i) made.push_back(values[i]);
    return made;
}

// values: a matrix, row-major.
Json rows(const double* values, std::size_t height, std::size_t width) {
    Json made = Json::array();
    for (std::size_t row = 0; row < height; ++row)
        made.push_back(numbers(values + row * width, width));
    return made;
}

// The four rows of a rigid motion.
Json transform(const double* values) {
    Json made = rows(values, 3, 4);
    made.push_back({0.0, 0.0, 0.0, 1.0});
    return made;
}

Json free_motion(const RegisterFindings& findings, std::size_t index) {
    auto motion = initialised<defrec_free_motion>();
    require(defrec_registration_get_free_motion(findings.found.handle.get(), index, &motion),
            ExitCode::kInternal, "reading the result");
    const bool is_turn = motion.kind == DEFREC_FREE_TURN;
    Json made;
    made["kind"] = is_turn ? "turn" : "shift";
    made["axis"] = numbers(motion.axis, 3);
    if (is_turn) {
        made["point"] = numbers(motion.point, 3);
        made["pitch_mm_per_rad"] = motion.pitch_mm_per_rad;
    }
    made["expected_mm"] = motion.expected_mm;
    made["text"] = motion.text;
    return made;
}

Json alternative(const RegisterFindings& findings, std::size_t index) {
    auto other = initialised<defrec_registration_alternative>();
    require(defrec_registration_get_alternative(findings.found.handle.get(), index, &other),
            ExitCode::kInternal, "reading the result");
    return {{"transform", transform(other.transform)},
            {"distance_mm", other.distance_mm},
            {"rms_mm", other.rms_mm},
            {"inlier_share", other.inlier_share}};
}

Json target_json(const RegisterFindings& findings, const ModelTarget& target) {
    const MovedTarget at = moved(findings, target);
    const std::array<double, 6>& c = at.covariance;
    const std::array<double, 9> matrix{c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5]};
    Json made;
    made["name"] = target.name;
    made["model"] = numbers(target.place.data(), 3);
    made["position"] = numbers(at.place.data(), 3);
    made["expected_error_mm"] = at.expected_error_mm;
    made["covariance_mm2"] = rows(matrix.data(), 3, 3);
    return made;
}

// Null where none was asked for.
Json deformation_json(const defrec_registration_info& info) {
    if (info.deformation == DEFREC_DEFORMATION_NOT_ASKED) return nullptr;
    return {{"applied", info.deformation == DEFREC_DEFORMATION_APPLIED},
            {"reason", info.deformation_text},
            {"rms_mm", info.deformed_rms_mm},
            {"max_mm", info.deformed_max_mm},
            {"largest_strain", info.largest_strain},
            {"rigid_rms_mm", info.rigid_rms_mm},
            {"rigid_robust_mm", info.rigid_robust_mm}};
}

Json residuals_json(const defrec_registration_info& info) {
    return {{"rms_mm", info.rms_mm},           {"robust_mm", info.robust_mm},
            {"error_ratio", info.error_ratio}, {"inlier_share", info.inlier_share},
            {"correlated", info.correlated},   {"used", info.used}};
}

}  // namespace

MovedTarget moved(const RegisterFindings& findings, const ModelTarget& target) {
    MovedTarget made;
    require(defrec_registration_move_points(findings.found.handle.get(), target.place.data(), 1,
                                            made.place.data(), made.covariance.data(),
                                            &made.expected_error_mm),
            ExitCode::kInternal, "moving a target");
    return made;
}

const char* name_of_verdict(std::uint32_t verdict) {
    switch (verdict) {
        case DEFREC_VERDICT_ACCEPTED:
            return "registered";
        case DEFREC_VERDICT_AMBIGUOUS:
            return "ambiguous";
        case DEFREC_VERDICT_UNDETERMINED:
            return "undetermined";
        default:
            return "failed";
    }
}

Json register_json(const RegisterFindings& findings) {
    const defrec_registration_info& info = findings.info();
    Json made;
    made["verdict"] = name_of_verdict(findings.verdict);
    made["reason"] = findings.reason;
    made["method"] = findings.method;
    made["transform"] = transform(info.transform);
    made["covariance"] = rows(info.covariance, 6, 6);
    made["covariance_of"] =
        "turn in rad about x, y, z, then shift in mm, of a motion of the surface's frame about its "
        "origin after the transform";
    made["undetermined"] = Json::array();
    for (std::size_t i = 0; i < info.free_motion_count; ++i)
        made["undetermined"].push_back(free_motion(findings, i));
    made["residuals"] = residuals_json(findings.fit());
    made["deformation"] = deformation_json(findings.fit());
    made["pairs"] = Json::array();
    for (const PairFinding& pair : findings.pairs)
        made["pairs"].push_back(
            {{"id", pair.id}, {"residual_mm", pair.residual_mm}, {"fits", pair.fits}});
    made["alternatives"] = Json::array();
    for (std::size_t i = 0; i < info.alternative_count; ++i)
        made["alternatives"].push_back(alternative(findings, i));
    made["targets"] = Json::array();
    for (const ModelTarget& target : findings.targets)
        made["targets"].push_back(target_json(findings, target));
    made["plan"] = findings.plan.empty()
                       ? Json(nullptr)
                       : Json{{"file", findings.plan}, {"targets", findings.plan_targets}};
    made["notes"] = findings.notes;
    return made;
}

std::string register_text(const RegisterFindings& findings) {
    std::string text =
        std::string(name_of_verdict(findings.verdict)) + ": " + findings.reason + "\n";
    if (findings.info().deformation == DEFREC_DEFORMATION_APPLIED)
        text += std::string("deformed: ") + findings.info().deformation_text + "\n";
    if (findings.info().deformation == DEFREC_DEFORMATION_REFUSED)
        text += std::string("not deformed: ") + findings.info().deformation_text + "\n";
    for (const std::string& note : findings.notes) text += "note: " + note + "\n";
    constexpr std::size_t kMostShown = 10;
    for (std::size_t i = 0; i < findings.targets.size() && i < kMostShown; ++i) {
        const ModelTarget& target = findings.targets[i];
        const MovedTarget at = moved(findings, target);
        text += "target " + printable(target.name) + ": " + format_fixed(at.place[0], 2) + " " +
                format_fixed(at.place[1], 2) + " " + format_fixed(at.place[2], 2) +
                " mm, expected error " + format_fixed(at.expected_error_mm, 2) + " mm\n";
    }
    if (findings.targets.size() > kMostShown)
        text += "... and " + std::to_string(findings.targets.size() - kMostShown) +
                " more in registration.json\n";
    if (!findings.plan.empty()) text += "plan: " + findings.plan + "\n";
    return text;
}

}  // namespace defrec::cli
