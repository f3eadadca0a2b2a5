// How the parts of a surface's piece are displaced together: modes, each with a coefficient for
// each axis, and what frames taught of the coefficients' covariance by expectation maximisation
// (Dempster, Laird and Rubin, 1977).
#pragma once
#include <Eigen/Core>

namespace defrec {

// The largest principal components of Matern's covariance of order 3/2 between cells.
class DisplacementModes {
  public:
    DisplacementModes() = default;
    // cells: a column for each, mm. length_mm: over which displacements are alike.
    DisplacementModes(const Eigen::Matrix3Xd& cells, double length_mm);

    Eigen::Index count() const { return spread_.size(); }
    // Shapes of the modes, a row for each place.
    Eigen::MatrixXd shapes(const Eigen::Matrix3Xd& places) const;
    const Eigen::MatrixXd& at_cells() const { return at_cells_; }
    // Variances of the modes, of the covariance's 1.
    const Eigen::VectorXd& spread() const { return spread_; }

  private:
    Eigen::MatrixXd kernel(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) const;

    Eigen::Matrix3Xd cells_;
    double length_mm_ = 1;
    Eigen::MatrixXd at_cells_, weigher_;  // weigher_: of the kernel with the cells
    Eigen::VectorXd spread_;
};

// The covariance that is learnt of coefficients of such modes.
class LearntCoefficients {
  public:
    explicit LearntCoefficients(const DisplacementModes& modes);
    // The same of other modes, whose shapes at the cells of these are given.
    void learn_from(const LearntCoefficients& before, const DisplacementModes& modes,
                    const Eigen::MatrixXd& shapes_before, const Eigen::VectorXd& spread_before);

    // A frame's; covariance: of the coefficients' errors, mm^2.
    void learn(const Eigen::MatrixX3d& coefficients, const Eigen::MatrixXd& covariance);
    // The inverse of the coefficients' covariance, 1/mm^2.
    const Eigen::MatrixXd& information();

  private:
    Eigen::MatrixXd products_;     // the sum of products of coefficients
    Eigen::MatrixXd start_;        // the same before anything is learnt
    Eigen::MatrixXd information_;  // empty until it is asked for
    double frames_ = 0;
};

}  // namespace defrec
