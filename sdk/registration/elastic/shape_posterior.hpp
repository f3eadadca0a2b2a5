// A rigid motion and a shape together by data, where shapes are known beforehand to be normally
// distributed, with a variance by their stiffness: a linear-Gaussian posterior.
#pragma once
#include <Eigen/Core>

#include "sdk/registration/pose.hpp"

namespace defrec {

// Normal equations of six numbers of a motion, about where it is, and the coefficients of a shape,
// about none.
struct ShapeEquations {
    explicit ShapeEquations(Eigen::Index modes)
        : cross(Eigen::MatrixXd::Zero(6, modes)),
          shape(Eigen::MatrixXd::Zero(modes, modes)),
          shape_right(Eigen::VectorXd::Zero(modes)) {}

    TwistMatrix motion = TwistMatrix::Zero();
    Eigen::MatrixXd cross, shape;
    Twist motion_right = Twist::Zero();
    Eigen::VectorXd shape_right;
};

struct ShapePosterior {
    Twist motion = Twist::Zero();
    Eigen::VectorXd shape;
    Eigen::MatrixXd covariance;  // of motion and shape, (6 + modes)^2
    // Logarithm of how much likelier the data are than without a deformation, by the prior of those
    // of smaller scales as well that makes them likeliest.
    double evidence = 0;
};

// stiffness: of each mode, see ForceModes. The prior of mode i is normal with the variance
// scale^2 stiffness_i^-p / sum_k stiffness_k^-p, so that the surface is displaced by the scale,
// root mean square. p = 1 would be the distribution whose logarithm is the elastic energy, p = 2 is
// that of forces without preference, larger ones are of smoother forces. Those of ShapePrior are
// averaged by how likely they make the data (Bayesian model averaging: Hoeting et al., Statistical
// Science 14, 1999; evidence: MacKay, Neural Computation 4, 1992).
ShapePosterior posterior_of(const ShapeEquations& equations, const Eigen::VectorXd& stiffness,
                            double scale_mm);

}  // namespace defrec
