// See pairs_and_surface.hpp. The library's registration by a surface gives a pose and a covariance;
// both go into the least squares of the pairs as places around the middle of the surface, each with
// the covariance C that it has there, times their number n. The errors of these places are one and
// the same, and may not count n times: the sum of the information of places J^T (n C)^-1 J is never
// more than that of the pose, as for each alone J^T (J P J^T)^-1 J <= P^-1 (as the weights of
// covariance intersection: Julier and Uhlmann, ACC 1997). So errors that are told are never too
// small; along motions that are open the places have a metre, and the pairs decide.
#include "sdk/registration/program/pairs_and_surface.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

#include "sdk/io/text.hpp"
#include "sdk/registration/program/decisions.hpp"

namespace defrec::cli {
namespace {

using decisions::PairsWithSurface;
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

Eigen::Isometry3d pose_of(const Registered& found) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.affine() =
        Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(found.info.transform);
    return pose;
}

// values: xx, xy, xz, yy, yz, zz.
Eigen::Matrix3d symmetric(const double* values) {
    Eigen::Matrix3d made;
    made << values[0], values[1], values[2], values[1], values[3], values[4], values[2], values[4],
        values[5];
    return made;
}

Eigen::Vector3d vector_at(const std::vector<double>& xyz, std::size_t i) {
    return Eigen::Map<const Eigen::Vector3d>(&xyz[3 * i]);
}

struct Placed {
    Eigen::Vector3d place;
    Eigen::Matrix3d covariance;
};

Placed placed(const Registered& found, const Eigen::Vector3d& model) {
    Placed made;
    std::array<double, 6> values{};
    require(defrec_registration_move_points(found.handle.get(), model.data(), 1, made.place.data(),
                                            values.data(), nullptr),
            ExitCode::kInternal, "moving a place");
    made.covariance = symmetric(values.data());
    return made;
}

// Places of the seen surface: as far from its middle as its points are, root mean square, to all
// sides. Model frame.
std::vector<Eigen::Vector3d> places_around(const Registered& found,
                                           std::span<const float> surface) {
    const Eigen::Map<const Eigen::Matrix3Xf> points(surface.data(), 3,
                                                    static_cast<Eigen::Index>(surface.size() / 3));
    const Eigen::Matrix3Xd seen = points.cast<double>();
    const Eigen::Vector3d middle = seen.rowwise().mean();
    const double length = std::sqrt((seen.colwise() - middle).colwise().squaredNorm().mean());
    const Eigen::Isometry3d to_model = pose_of(found).inverse();
    std::vector<Eigen::Vector3d> places;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-length, length})
            places.push_back(to_model *
                             Eigen::Vector3d(middle + side * Eigen::Vector3d::Unit(axis)));
    return places;
}

// Root mean square over these places, mm.
double expected_error(const Registered& found, const SurfaceEvidence& surface) {
    double squared = 0;
    const std::vector<Eigen::Vector3d> places = places_around(found, surface.places);
    for (const Eigen::Vector3d& model : places) squared += placed(found, model).covariance.trace();
    return std::sqrt(squared / static_cast<double>(places.size()));
}

// The pairs, and what a registration by the surface says as such.
PairsFile with_surface(const Registered& by_surface, const SurfaceEvidence& surface,
                       PairsFile pairs) {
    const std::vector<Eigen::Vector3d> places = places_around(by_surface, surface.places);
    for (const Eigen::Vector3d& model : places) {
        const auto [place, covariance] = placed(by_surface, model);
        pairs.ids.push_back(-1);
        pairs.model_xyz.insert(pairs.model_xyz.end(), model.begin(), model.end());
        pairs.seen_xyz.insert(pairs.seen_xyz.end(), place.begin(), place.end());
        const Eigen::Matrix3d stated = static_cast<double>(places.size()) * covariance;
        for (int row = 0; row < 3; ++row)
            for (int column = row; column < 3; ++column)
                pairs.seen_covariance.push_back(stated(row, column));
        pairs.model_covariance.insert(pairs.model_covariance.end(), 6, 0.0);
    }
    return pairs;
}

// The id of the pair that is farthest off, and by how much.
std::string worst_pair(const Registered& found, const PairsEvidence& pairs) {
    PairFinding worst;
    for (const PairFinding& pair : pair_findings(found, pairs))
        if (pair.residual_mm > worst.residual_mm) worst = pair;
    return "pair " + std::to_string(worst.id) + " is " + format_fixed(worst.residual_mm, 2) +
           " mm off";
}

// Empty: there is none.
std::string contradiction(const Registered& by_surface, const SurfaceEvidence& surface,
                          const PairsEvidence& pairs) {
    if (by_surface.info.verdict == DEFREC_VERDICT_FAILED)
        return "the surface and the pairs contradict each other: where the pairs put the model, " +
               std::string(by_surface.info.reason);
    const Eigen::Isometry3d at_surface = pose_of(by_surface), at_pairs = pose_of(pairs.alone);
    const Eigen::Isometry3d motion = at_pairs * at_surface.inverse();
    const Eigen::AngleAxisd turn(motion.linear());
    Eigen::Matrix<double, 6, 1> twist;  // about the origin of the surface's frame
    twist << turn.angle() * turn.axis(), motion.translation();
    const Matrix6 covariance = Eigen::Map<const Matrix6>(pairs.alone.info.covariance) +
                               Eigen::Map<const Matrix6>(by_surface.info.covariance);
    const double squared = twist.dot(covariance.ldlt().solve(twist));
    const double chance = chance_of(squared, 3, pairs.freedom);
    if (chance > PairsWithSurface::kChance) return {};
    double apart = 0;
    const std::vector<Eigen::Vector3d> places = places_around(by_surface, surface.places);
    for (const Eigen::Vector3d& model : places)
        apart += (at_pairs * model - at_surface * model).squaredNorm() /
                 static_cast<double>(places.size());
    return "the surface and the pairs contradict each other: they put the model " +
           format_fixed(std::sqrt(apart), 2) + " mm apart, " +
           format_fixed(std::sqrt(squared / 6), 1) + " times what their errors explain; " +
           worst_pair(by_surface, pairs);
}

std::string reason_of_both(const Registered& by_surface, const PairsEvidence& pairs,
                           const Registered& by_both) {
    double squared = 0, count = 0;
    const std::vector<PairFinding> found = pair_findings(by_both, pairs);
    for (std::size_t i = 0; i < found.size(); ++i) {
        if (pairs.counts[i] == 0) continue;
        squared += found[i].residual_mm * found[i].residual_mm;
        ++count;
    }
    std::string adds = "; the pairs tell which is right";
    if (by_surface.is_accepted()) adds = "; the pairs make it more exact";
    if (by_surface.info.verdict == DEFREC_VERDICT_UNDETERMINED)
        adds = "; with the pairs it is held to " + held(by_surface, pairs.all, by_both);
    return by_surface.info.reason + adds + ": " + format_fixed(count, 0) +
           " pairs agree with the surface to " + format_fixed(std::sqrt(squared / count), 2) +
           " mm";
}

}  // namespace

std::string held(const Registered& by_surface, const PairsFile& pairs, const Registered& by) {
    const Eigen::Map<const Matrix6> twist(by.info.covariance);
    const Eigen::Vector3d middle =
        Eigen::Map<const Eigen::Matrix3Xd>(pairs.seen_xyz.data(), 3,
                                           static_cast<Eigen::Index>(pairs.ids.size()))
            .rowwise()
            .mean();
    Eigen::Matrix<double, 3, 6> shift;  // of the middle, by a twist
    shift << 0, middle.z(), -middle.y(), 1, 0, 0, -middle.z(), 0, middle.x(), 0, 1, 0, middle.y(),
        -middle.x(), 0, 0, 0, 1;
    std::string text;
    for (std::size_t i = 0; i < by_surface.info.free_motion_count; ++i) {
        auto motion = initialised<defrec_free_motion>();
        require(defrec_registration_get_free_motion(by_surface.handle.get(), i, &motion),
                ExitCode::kInternal, "reading the result");
        const Eigen::Map<const Eigen::Vector3d> axis(motion.axis);
        text += i > 0 ? ", " : "";
        if (motion.kind == DEFREC_FREE_TURN) {
            const double turn = std::sqrt(axis.dot(twist.topLeftCorner<3, 3>() * axis));
            text += format_fixed(turn * 180 / std::numbers::pi, 2) + " degrees";
        } else {
            const double along = (shift.transpose() * axis).dot(twist * shift.transpose() * axis);
            text += format_fixed(std::sqrt(along), 2) + " mm";
        }
    }
    return text;
}

Together together(const Registered& by_surface, const SurfaceEvidence& surface,
                  const PairsEvidence& pairs, const RegisterOptions& options) {
    Together made;
    const auto contradicts = [&](const Registered& compared) {
        made.reason = contradiction(compared, surface, pairs);
        made.is_contradiction = !made.reason.empty();
        return made.is_contradiction;
    };
    if (by_surface.is_accepted() && contradicts(by_surface)) return made;
    const Registered* start = by_surface.is_accepted() ? &by_surface : &pairs.alone;
    Registered both;
    for (int round = 0; round < PairsWithSurface::kRounds; ++round) {
        made.by_surface = surface.near(start->transform());
        if (contradicts(made.by_surface)) return made;
        both = register_by_pairs(with_surface(made.by_surface, surface, pairs.counted()), options);
        if (!both.is_accepted()) return made;
        start = &both;
    }
    if (by_surface.is_accepted() &&
        expected_error(both, surface) >= expected_error(by_surface, surface))
        return made;
    made.by_both = std::move(both);
    made.by_surface = surface.near(made.by_both.transform());
    made.reason = reason_of_both(by_surface, pairs, made.by_both);
    return made;
}

std::vector<PairFinding> pair_findings(const Registered& found, const PairsEvidence& pairs) {
    const Eigen::Matrix3d turn = pose_of(found).linear();
    std::vector<PairFinding> made;
    for (std::size_t i = 0; i < pairs.all.ids.size(); ++i) {
        const auto [place, covariance] = placed(found, vector_at(pairs.all.model_xyz, i));
        const Eigen::Vector3d residual = vector_at(pairs.all.seen_xyz, i) - place;
        const Eigen::Matrix3d expected =
            covariance + symmetric(&pairs.all.seen_covariance[6 * i]) +
            turn * symmetric(&pairs.all.model_covariance[6 * i]) * turn.transpose();
        const double ratio = std::sqrt(residual.dot(expected.ldlt().solve(residual)));
        made.push_back({pairs.all.ids[i], residual.norm(),
                        pairs.counts[i] != 0 && ratio <= PairsWithSurface::kMaxRatio});
    }
    return made;
}

}  // namespace defrec::cli
