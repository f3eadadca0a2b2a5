// See shape_posterior.hpp. The motion has no prior and is eliminated (Schur complement); for each
// exponent the eigenvectors of what remains, in units of the prior, give the posterior of any
// scale.
#include "sdk/registration/elastic/shape_posterior.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "sdk/registration/decisions.hpp"

namespace defrec {
namespace {

// Shapes by one exponent, in units in which prior and data are diagonal.
struct Whitened {
    Eigen::MatrixXd to_shape;
    Eigen::VectorXd information, right;
    double evidence = 0;  // with the stated scale

    // Variances that remain.
    Eigen::VectorXd gain(double scale) const {
        return information.unaryExpr(
            [s = scale * scale](double value) { return s / (1 + s * value); });
    }
};

Whitened whiten(const Eigen::MatrixXd& information, const Eigen::VectorXd& right,
                const Eigen::VectorXd& stiffness, double exponent) {
    const Eigen::ArrayXd power = (stiffness / stiffness[0]).array().pow(-exponent);
    const Eigen::VectorXd deviation = (power / power.sum()).sqrt();
    const Eigen::MatrixXd scaled = deviation.asDiagonal() * information * deviation.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled);
    Whitened made;
    made.to_shape = deviation.asDiagonal() * solver.eigenvectors();
    made.information = solver.eigenvalues().cwiseMax(0);
    made.right = made.to_shape.transpose() * right;
    return made;
}

double evidence_of(const Whitened& whitened, double scale) {
    const Eigen::ArrayXd ratio = scale * scale * whitened.information.array();
    return ((scale * scale * whitened.right.array().square() / (1 + ratio)).sum() -
            ratio.log1p().sum()) /
           2;
}

}  // namespace

ShapePosterior posterior_of(const ShapeEquations& equations, const Eigen::VectorXd& stiffness,
                            double scale_mm) {
    const Eigen::LDLT<TwistMatrix> motion(equations.motion);
    const TwistMatrix motion_inverse = motion.solve(TwistMatrix::Identity());
    const Eigen::MatrixXd follows = -motion_inverse * equations.cross;  // the motion, a shape
    const Eigen::MatrixXd information = equations.shape + equations.cross.transpose() * follows;
    const Eigen::VectorXd right =
        equations.shape_right + follows.transpose() * equations.motion_right;

    using decisions::ShapePrior;
    std::vector<Whitened> priors;
    ShapePosterior made;
    double best = -std::numeric_limits<double>::infinity();
    for (int exponent = ShapePrior::kMinExponent; exponent <= ShapePrior::kMaxExponent;
         ++exponent) {
        priors.push_back(whiten(information, right, stiffness, exponent));
        priors.back().evidence = evidence_of(priors.back(), scale_mm);
        best = std::max(best, priors.back().evidence);
        for (double scale = scale_mm; scale * ShapePrior::kScaleRange >= scale_mm;
             scale /= ShapePrior::kScaleStep)
            made.evidence = std::max(made.evidence, evidence_of(priors.back(), scale));
    }
    double sum = 0;
    for (const Whitened& prior : priors) sum += std::exp(prior.evidence - best);
    const Eigen::Index modes = stiffness.size();
    made.shape = Eigen::VectorXd::Zero(modes);
    // The mean of the squares, less the square of the mean.
    Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(modes, modes);
    for (const Whitened& prior : priors) {
        const double weight = std::exp(prior.evidence - best) / sum;
        const Eigen::VectorXd gain = prior.gain(scale_mm),
                              shape = prior.to_shape * gain.cwiseProduct(prior.right);
        made.shape += weight * shape;
        spread += weight * (prior.to_shape * gain.asDiagonal() * prior.to_shape.transpose() +
                            shape * shape.transpose());
    }
    spread -= made.shape * made.shape.transpose();
    made.motion = motion_inverse * equations.motion_right + follows * made.shape;
    made.covariance.resize(6 + modes, 6 + modes);
    made.covariance.topLeftCorner<6, 6>() = motion_inverse + follows * spread * follows.transpose();
    made.covariance.topRightCorner(6, modes) = follows * spread;
    made.covariance.bottomLeftCorner(modes, 6) = (follows * spread).transpose();
    made.covariance.bottomRightCorner(modes, modes) = spread;
    return made;
}

}  // namespace defrec
