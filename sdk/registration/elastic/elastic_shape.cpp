// See elastic_shape.hpp.
#include "sdk/registration/elastic/elastic_shape.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sdk/registration/decisions.hpp"

namespace defrec {
namespace {

// A root of a covariance, without what rounding makes negative. In units of the deviations: turns
// and shifts differ by far.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
    const Eigen::VectorXd deviation = covariance.diagonal().cwiseMax(0).cwiseSqrt();
    const Eigen::VectorXd scale =
        deviation.unaryExpr([](double value) { return value > 0 ? 1 / value : 0; });
    const Eigen::MatrixXd shares = scale.asDiagonal() * covariance * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(shares);
    const Eigen::VectorXd& values = solver.eigenvalues();  // they rise
    Eigen::Index first = 0;
    while (values[first] <= decisions::ElasticModel::kMinPower * values.tail<1>().value()) ++first;
    const Eigen::Index kept = values.size() - first;
    return deviation.asDiagonal() * solver.eigenvectors().rightCols(kept) *
           values.tail(kept).cwiseSqrt().asDiagonal();
}

}  // namespace

ElasticShape::ElasticShape(Parts parts)
    : parts_(std::move(parts)), root_(root_of(parts_.covariance)) {}

double ElasticShape::distance_seen(const Eigen::Vector3d& place) const {
    float least = std::numeric_limits<float>::infinity();
    const Eigen::Vector3f at = place.cast<float>();
    for (const Eigen::Vector3f& seen : parts_.seen)
        least = std::min(least, (seen - at).squaredNorm());
    return static_cast<double>(std::sqrt(least));
}

PlacedPoint ElasticShape::placed(const Pose& pose, const Eigen::Vector3d& place) const {
    const ForceModes::Shifts shifts = parts_.modes->at(place);
    const Eigen::Vector3d shift = shifts * parts_.coefficients, seen = pose * (place + shift);
    const Eigen::MatrixXd spread = place_shift(seen) * root_.topRows<6>() +
                                   pose.rotation * shifts * root_.bottomRows(shifts.cols());
    Eigen::Matrix3d covariance = spread * spread.transpose();
    // The organ is not the body that is computed: it has vessels, ligaments, forces within, and
    // its strains are not small. What is seen tells places across the surface, not along it.
    const double distance = distance_seen(place) + decisions::ElasticModel::kSeenLength;
    const double unlike =
        decisions::ElasticModel::kUnlikeShare * parts_.rms_strain * (distance + shift.norm());
    covariance.diagonal().array() += unlike * unlike / 3;
    return {seen, covariance};
}

}  // namespace defrec
