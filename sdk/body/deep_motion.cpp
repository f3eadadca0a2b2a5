// See deep_motion.hpp.
#include "sdk/body/deep_motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace defrec {
namespace {

constexpr int kRounds = 16;  // of reweighting

// The value that half of the weight does not exceed.
double weighted_median(const Eigen::VectorXd& values, const Eigen::VectorXd& weight) {
    // By bisection, which sorts nothing.
    double low = 0, high = values.maxCoeff();
    const double half = weight.sum() / 2;
    for (int round = 0; round < 20; ++round) {
        const double middle = (low + high) / 2;
        ((values.array() <= middle).select(weight.array(), 0.0).sum() >= half ? high : low) =
            middle;
    }
    return high;
}

// Weights after Geman and McClure: 1 for a residual of 0, a quarter for one of that scale.
Eigen::VectorXd robust_weights(const Eigen::VectorXd& residual, const Eigen::VectorXd& weight,
                               double scale) {
    return weight.array() / (1 + (residual.array() / scale).square()).square();
}

}  // namespace

Eigen::Isometry3d fit_rigid(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                            const Eigen::VectorXd& weight) {
    const double sum = std::max(weight.sum(), 1e-12);
    const Eigen::Vector3d from_mean = from * weight / sum, to_mean = to * weight / sum;
    const Eigen::Matrix3d products =
        (to.colwise() - to_mean) * weight.asDiagonal() * (from.colwise() - from_mean).transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(products,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    motion.linear() =
        svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
    motion.translation() = to_mean - motion.linear() * from_mean;
    return motion;
}

Eigen::Isometry3d fit_rigid_robust(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                   const Eigen::VectorXd& weight, double floor_mm) {
    Eigen::Isometry3d motion = fit_rigid(from, to, weight);
    for (int round = 0; round < kRounds; ++round) {
        const Eigen::VectorXd residual =
            (((motion.linear() * from).colwise() + motion.translation()) - to).colwise().norm();
        const double scale = std::max(floor_mm, weighted_median(residual, weight));
        motion = fit_rigid(from, to, robust_weights(residual, weight, scale));
    }
    return motion;
}

Eigen::Matrix<double, 6, 1> sparsest(const Eigen::VectorXd& residuals,
                                     const Eigen::Matrix<double, Eigen::Dynamic, 6>& slope,
                                     const Eigen::VectorXd& weight, double floor) {
    using Motion = Eigen::Matrix<double, 6, 1>;
    Motion motion = Motion::Zero();
    Eigen::VectorXd size(weight.size());
    for (int round = 0; round < kRounds; ++round) {
        const Eigen::VectorXd left = residuals - slope * motion;
        for (Eigen::Index i = 0; i < size.size(); ++i) size[i] = left.segment<3>(3 * i).norm();
        const double scale = std::max(floor, weighted_median(size, weight));
        const Eigen::VectorXd now = robust_weights(size, weight, scale);
        Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
        Motion right = Motion::Zero();
        for (Eigen::Index i = 0; i < size.size(); ++i) {
            const auto rows = slope.middleRows<3>(3 * i);
            sum += now[i] * rows.transpose() * rows;
            right += now[i] * rows.transpose() * residuals.segment<3>(3 * i);
        }
        motion = sum.ldlt().solve(right);
    }
    return motion.allFinite() ? motion : Motion::Zero();
}

Eigen::Isometry3d small_motion(const Eigen::Matrix<double, 6, 1>& motion) {
    Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
    const Eigen::Vector3d turn = motion.tail<3>();
    if (const double angle = turn.norm(); angle > 1e-12)
        result.linear() = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
    result.translation() = motion.head<3>();
    return result;
}

}  // namespace defrec
