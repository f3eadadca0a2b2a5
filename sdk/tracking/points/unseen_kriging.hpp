// Universal kriging of how a surface's parts are displaced (Cressie, Statistics for Spatial Data,
// 1993, 3.4) in a basis of few modes: least squares of their coefficients and of a small rigid
// motion, the trend, which nothing is known of beforehand. A mode has a coefficient for each axis;
// arrays of coefficients have those of the x axis first, then y, then z.
#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <utility>

#include "sdk/body/deep_motion.hpp"

namespace defrec {

// How coefficients and a small rigid motion displace places.
struct DisplacementModel {
    // shapes: of the modes, a row for each place. from_centre: the places, from the centre about
    // which the motion turns, mm.
    DisplacementModel() = default;
    DisplacementModel(Eigen::MatrixXd shapes, const Eigen::Matrix3Xd& from_centre);

    DisplacementModel part(std::span<const Eigen::Index> places) const;
    // The model of the places along an axis times a matrix with a row for each coefficient, and six
    // for the motion.
    Eigen::MatrixXd times(size_t axis, const Eigen::MatrixXd& matrix) const;
    Eigen::Index places() const { return shapes.rows(); }
    Eigen::Index modes() const { return shapes.cols(); }

    Eigen::MatrixXd shapes;
    std::array<MotionSlope, 3> slope;  // per axis, a row for each place
};

// Adds a matrix for each axis to coefficients' products.
void add_on_axes(const Eigen::MatrixXd& values, Eigen::MatrixXd& sum);
// Inverse of a symmetric matrix that is positive definite; NaN where it is not.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& symmetric);

class UnseenKriging {
  public:
    // of: places of which some displacements are known. information: the inverse of the
    // coefficients' covariance, 1/mm^2.
    UnseenKriging(DisplacementModel of, Eigen::MatrixXd information)
        : of_(std::move(of)), information_(std::move(information)) {}

    // weight: of the displacement of each place, the inverse of its variance per axis, 1/mm^2; 0
    // where it is not known.
    void weigh(const Eigen::VectorXd& weight);
    const Eigen::VectorXd& weight() const { return weight_; }
    const Eigen::MatrixXd& shapes() const { return of_.shapes; }

    // The members below follow weigh().
    struct Found {
        Eigen::MatrixX3d coefficients;  // a column for each axis
        SmallMotion motion;
    };
    // displacements: of the places, mm; finite where they are not known.
    Found solve(const Eigen::Matrix3Xd& displacements) const;
    // Before surprises(), where weights have not been changed; the second call does nothing.
    void find_doubts();
    // Squared distance of a place's displacement from the one that was found of these, in its
    // variances of an axis: 1 where chance alone makes it, 0 where the displacement is not known.
    Eigen::VectorXd surprises(const Eigen::Matrix3Xd& displacements, const Found& found) const;
    // Variances of the displacements that are found with the weights of weigh(), three axes
    // together, mm^2; and by how much they are less with those of change().
    Eigen::VectorXd variances(const DisplacementModel& of) const;
    Eigen::VectorXd lessened(const DisplacementModel& of) const;

    // Before covariance() and change().
    void find_covariance();
    // The coefficients' own, mm^2, by the weights of weigh().
    Eigen::MatrixXd covariance() const;
    // Gives places other weights (Woodbury, Inverting modified matrices, 1950), of which the
    // weights of weigh() know nothing. What it takes grows with the number of places.
    void change(std::span<const Eigen::Index> places, const Eigen::VectorXd& weight);

  private:
    Eigen::MatrixXd reduce(const DisplacementModel& of, size_t axis) const;

    DisplacementModel of_;
    Eigen::MatrixXd information_;
    Eigen::VectorXd weight_;
    // Inverse of the Cholesky factor of the information on coefficients and motion.
    Eigen::MatrixXd reducer_;
    Eigen::MatrixXd covariance_;  // of coefficients and motion
    // Three columns for each place: inverse of the covariance of what its displacement has besides
    // what is found.
    Eigen::Matrix3Xd doubts_;
    // Since weights were changed, the covariance is less by root, divided by the pivots, root
    // transposed.
    struct Change {
        Eigen::MatrixXd root;
        Eigen::VectorXd pivots;
    };
    std::optional<Change> change_;
};

}  // namespace defrec
