// See unseen_modes.hpp.
#include "sdk/tracking/points/unseen_modes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sdk/tracking/decisions/unseen.hpp"
#include "sdk/tracking/points/unseen_kriging.hpp"

namespace defrec {
namespace {

using Decision = decisions::UnseenMotion;

constexpr double kJitter = 1e-6;

}  // namespace

DisplacementModes::DisplacementModes(const Eigen::Matrix3Xd& cells, double length_mm)
    : cells_(cells), length_mm_(length_mm) {
    const Eigen::Index modes = std::min(cells.cols(), Decision::kModes);
    Eigen::MatrixXd alike = kernel(cells, cells);
    alike.diagonal().array() += kJitter;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(alike);
    at_cells_ = parts.eigenvectors().rightCols(modes);
    spread_ = parts.eigenvalues().tail(modes);
    weigher_ = at_cells_ * spread_.cwiseInverse().asDiagonal();
}

// Matern's covariance of order 3/2.
Eigen::MatrixXd DisplacementModes::kernel(const Eigen::Matrix3Xd& a,
                                          const Eigen::Matrix3Xd& b) const {
    const double scale = std::sqrt(3.0) / length_mm_;
    Eigen::MatrixXd values(a.cols(), b.cols());
    Eigen::ArrayXd distance(a.cols());
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
        distance = scale * (a.colwise() - b.col(j)).colwise().norm().transpose();
        values.col(j) = (1 + distance) * (-distance).exp();
    }
    return values;
}

Eigen::MatrixXd DisplacementModes::shapes(const Eigen::Matrix3Xd& places) const {
    return kernel(cells_, places).transpose() * weigher_;
}

LearntCoefficients::LearntCoefficients(const DisplacementModes& modes)
    : products_(Eigen::MatrixXd::Zero(3 * modes.count(), 3 * modes.count())), start_(products_) {
    add_on_axes(Decision::kStart * Decision::kStart * modes.spread().asDiagonal().toDenseMatrix(),
                start_);
}

void LearntCoefficients::learn_from(const LearntCoefficients& before,
                                    const DisplacementModes& modes,
                                    const Eigen::MatrixXd& shapes_before,
                                    const Eigen::VectorXd& spread_before) {
    const Eigen::MatrixXd change = modes.at_cells().transpose() * shapes_before,
                          unknown = modes.spread().asDiagonal().toDenseMatrix() -
                                    change * spread_before.asDiagonal() * change.transpose();
    Eigen::MatrixXd on_axes = Eigen::MatrixXd::Zero(products_.rows(), before.products_.rows());
    add_on_axes(change, on_axes);
    products_ = on_axes * before.products_ * on_axes.transpose();
    add_on_axes(before.frames_ * Decision::kStart * Decision::kStart * unknown, products_);
    frames_ = before.frames_;
}

void LearntCoefficients::learn(const Eigen::MatrixX3d& coefficients,
                               const Eigen::MatrixXd& covariance) {
    products_ *= Decision::kForget;
    products_.noalias() += coefficients.reshaped() * coefficients.reshaped().transpose();
    products_ += covariance;
    frames_ = Decision::kForget * frames_ + 1;
    information_.resize(0, 0);
}

const Eigen::MatrixXd& LearntCoefficients::information() {
    if (information_.size() == 0)
        information_ = (Decision::kStartFrames + frames_) *
                       inverse_of(products_ + Decision::kStartFrames * start_);
    return information_;
}

}  // namespace defrec
