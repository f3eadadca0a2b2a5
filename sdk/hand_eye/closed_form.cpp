// See closed_form.hpp.
#include "sdk/hand_eye/closed_form.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "sdk/hand_eye/decisions.hpp"
#include "sdk/hand_eye/pose_stream.hpp"

namespace defrec {
namespace {

using decisions::HandEyeStart;

struct RelativeMotion {
    Eigen::Isometry3d marker, camera;
};

// The nearest rotation.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d sign(1, 1, 1);
    if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) sign.z() = -1;
    return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

HandEyePairs spread(const HandEyePairs& pairs, std::size_t count) {
    if (pairs.size() <= count) return pairs;
    HandEyePairs some;
    for (std::size_t i = 0; i < count; ++i) some.push_back(pairs[i * pairs.size() / count]);
    return some;
}

std::vector<RelativeMotion> relative_motions(const HandEyePairs& pairs) {
    const HandEyePairs some = spread(pairs, HandEyeStart::kMaxPoses);
    std::vector<RelativeMotion> motions;
    for (std::size_t i = 0; i < some.size(); ++i)
        for (std::size_t k = i + 1; k < some.size(); ++k) {
            const RelativeMotion motion{some[i].tracker.inverse() * some[k].tracker,
                                        some[i].camera.inverse() * some[k].camera};
            const double marker = turn_of(motion.marker.linear()).norm(),
                         camera = turn_of(motion.camera.linear()).norm();
            if (std::min(marker, camera) > HandEyeStart::kMinTurn &&
                std::max(marker, camera) < HandEyeStart::kMaxTurn)
                motions.push_back(motion);
        }
    return motions;
}

Eigen::Matrix3d rotation_between(const std::vector<RelativeMotion>& motions) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const RelativeMotion& motion : motions)
        sum += turn_of(motion.marker.linear()) * turn_of(motion.camera.linear()).transpose();
    return nearest_rotation(sum);
}

// The shift of the transform, and by its side the factor of the world's lengths; has_factor: it is
// unknown, otherwise 1.
Eigen::Vector4d shift_between(const std::vector<RelativeMotion>& motions,
                              const Eigen::Matrix3d& rotation, bool has_factor) {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (const RelativeMotion& motion : motions) {
        const Eigen::Vector3d turned = rotation * motion.camera.translation();
        Eigen::Matrix<double, 3, 4> rows;
        rows.leftCols<3>() = motion.marker.linear() - Eigen::Matrix3d::Identity();
        rows.col(3) = has_factor ? Eigen::Vector3d(-turned) : Eigen::Vector3d::Zero();
        Eigen::Vector3d known = -motion.marker.translation();
        if (!has_factor) known += turned;
        normal += rows.transpose() * rows;
        right += rows.transpose() * known;
    }
    if (!has_factor) normal(3, 3) = right(3) = 1;
    return normal.colPivHouseholderQr().solve(right);
}

// The world in the tracking system, as the poses have it on average.
Eigen::Isometry3d world_of(const HandEyePairs& pairs, const Eigen::Isometry3d& marker_from_camera) {
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    for (const HandEyePair& pair : pairs)
        sum += (pair.tracker * marker_from_camera * pair.camera.inverse()).matrix();
    sum /= static_cast<double>(pairs.size());
    Eigen::Isometry3d world = Eigen::Isometry3d::Identity();
    world.linear() = nearest_rotation(sum.topLeftCorner<3, 3>());
    world.translation() = sum.topRightCorner<3, 1>();
    return world;
}

double median_error(const HandEyePairs& judges, const HandEyeNoise& noise,
                    const HandEyeTransforms& transforms) {
    const HandEyeMatrix whitening = hand_eye_whitening(noise, transforms);
    std::vector<double> errors;
    for (const HandEyePair& judge : judges)
        errors.push_back((whitening * hand_eye_residual(judge, transforms)).norm());
    const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
    std::nth_element(errors.begin(), middle, errors.end());
    return *middle;
}

}  // namespace

std::optional<HandEyeTransforms> closed_form(const HandEyePairs& pairs) {
    const std::vector<RelativeMotion> motions = relative_motions(pairs);
    if (motions.empty()) return {};
    HandEyeTransforms made;
    made.marker_from_camera.linear() = rotation_between(motions);
    made.marker_from_camera.translation() =
        shift_between(motions, made.marker_from_camera.linear(), false).head<3>();
    made.tracker_from_world = world_of(pairs, made.marker_from_camera);
    return made;
}

HandEyeStartFit robust_start(const HandEyePairs& pairs, const HandEyeNoise& noise) {
    const HandEyePairs judges = spread(pairs, HandEyeStart::kJudges);
    HandEyeStartFit best{{}, std::numeric_limits<double>::infinity()};
    const auto judge = [&](const HandEyePairs& some) {
        const std::optional<HandEyeTransforms> made = closed_form(some);
        if (!made) return;
        const double median = median_error(judges, noise, *made);
        if (median < best.median) best = {*made, median};
    };
    judge(pairs);
    std::mt19937 random(HandEyeStart::kSeed);
    std::uniform_int_distribution<std::size_t> pick(0, pairs.size() - 1);
    for (int i = 0; i < HandEyeStart::kSubsets; ++i) {
        const std::array<std::size_t, 3> at = {pick(random), pick(random), pick(random)};
        if (at[0] == at[1] || at[0] == at[2] || at[1] == at[2]) continue;
        judge({pairs[at[0]], pairs[at[1]], pairs[at[2]]});
    }
    return best;
}

double length_factor(const HandEyePairs& pairs) {
    const std::vector<RelativeMotion> motions = relative_motions(pairs);
    if (motions.empty()) return 0;
    const double factor = shift_between(motions, rotation_between(motions), true)(3);
    return factor > 0 && std::isfinite(factor) ? factor : 0;
}

}  // namespace defrec
