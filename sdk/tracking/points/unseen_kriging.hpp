// Universal kriging of how a surface's parts are displaced (Cressie, Statistics for Spatial Data,
// 1993, 3.4) in a basis of few modes: least squares of their coefficients and of a small rigid
// motion, the trend, which nothing is known of beforehand. A mode has a coefficient for each axis;
// arrays of coefficients have those of the x axis first, then y, then z.
#pragma once
#include <Eigen/Core>
#include <array>

#include "sdk/body/deep_motion.hpp"

namespace defrec {

// How coefficients and a small rigid motion displace places.
struct DisplacementModel {
    // shapes: of the modes, a row for each place. from_centre: the places, from the centre about
    // which the motion turns, mm.
    DisplacementModel(Eigen::MatrixXd shapes, const Eigen::Matrix3Xd& from_centre);

    Eigen::Index places() const { return shapes.rows(); }
    Eigen::Index modes() const { return shapes.cols(); }

    Eigen::MatrixXd shapes;
    std::array<MotionSlope, 3> slope;  // per axis, a row for each place
};

// Adds a matrix for each axis to coefficients' products.
void add_on_axes(const Eigen::MatrixXd& values, Eigen::MatrixXd& sum);
// Inverse of a symmetric matrix that is positive definite.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& symmetric);

class UnseenKriging {
  public:
    // seen: of places whose displacements are known. information: the inverse of the coefficients'
    // covariance, 1/mm^2.
    UnseenKriging(DisplacementModel seen, Eigen::MatrixXd information)
        : seen_(std::move(seen)), information_(std::move(information)) {}

    // noise: variance of the displacement of each place, per axis, mm^2.
    void weigh(const Eigen::VectorXd& noise);

    // The members below follow weigh().
    struct Found {
        Eigen::MatrixX3d coefficients;  // a column for each axis
        SmallMotion motion;
    };
    // displacements: of the places that are seen, mm.
    Found solve(const Eigen::Matrix3Xd& displacements) const;
    // A place that the others foretell otherwise is taken for as noisy as it seems. Returns the
    // largest factor by which noise grew.
    double raise_noise(const Eigen::Matrix3Xd& displacements, Eigen::VectorXd& noise) const;
    // Variances of the displacements that are found, three axes together, mm^2.
    Eigen::VectorXd variances(const DisplacementModel& of) const;
    // The coefficients' own, mm^2.
    Eigen::MatrixXd covariance() const;

  private:
    Eigen::MatrixXd reduce(const DisplacementModel& of, size_t axis) const;

    DisplacementModel seen_;
    Eigen::MatrixXd information_;
    Eigen::VectorXd weight_;
    // Inverse of the Cholesky factor of the information on coefficients and motion.
    Eigen::MatrixXd reducer_;
};

}  // namespace defrec
