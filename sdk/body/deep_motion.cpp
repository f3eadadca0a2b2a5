// See deep_motion.hpp.
#include "sdk/body/deep_motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "backends/shared/rigid_fit.hpp"
#include "sdk/body/decisions.hpp"

namespace defrec {
namespace {

constexpr int kRounds = 16;  // of reweighting, at most
// Variance across a row of points, in that along it, that tells how it turns about itself.
constexpr double kLeastSpread = 2e-3;
constexpr double kStillMm = 1e-4, kStillTurn = 1e-6;  // steps that change nothing

// The value that half of the weight does not exceed.
double weighted_median(const Eigen::VectorXd& values, const Eigen::VectorXd& weight) {
    // By bisection, which sorts nothing.
    constexpr int kHalvings = 14;
    double low = 0, high = values.maxCoeff();
    const double half = weight.sum() / 2;
    for (int round = 0; round < kHalvings; ++round) {
        const double middle = (low + high) / 2;
        ((values.array() <= middle).select(weight.array(), 0.0).sum() >= half ? high : low) =
            middle;
    }
    return high;
}

// Lengths of the handles' vectors.
Eigen::VectorXd sizes(const Eigen::VectorXd& values) {
    return Eigen::Map<const Eigen::Matrix3Xd>(values.data(), 3, values.size() / 3).colwise().norm();
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
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    if (svd.singularValues()[1] > kLeastSpread * svd.singularValues()[0]) {
        motion.linear() = rotation_from_svd(svd);
    } else if (svd.singularValues()[0] > 0) {
        const Eigen::Vector3d along = svd.matrixV().col(0), now = svd.matrixU().col(0);
        motion.linear() = Eigen::Quaterniond::FromTwoVectors(along, now).toRotationMatrix();
    }
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

MotionPrior camera_prior(const Eigen::Isometry3d& estimate, const Eigen::Isometry3d& expected,
                         const Eigen::Vector3d& centre) {
    using Decision = decisions::DeepMotion;
    const Eigen::Isometry3d step = estimate.inverse() * expected;
    const Eigen::AngleAxisd turn(step.linear());
    MotionPrior prior;
    prior.motion.tail<3>() = turn.angle() * turn.axis();
    prior.motion.head<3>() = step.translation();
    MotionSlope at_centre = motion_slope(centre);
    prior.information =
        at_centre.transpose() * at_centre / (Decision::kBreathingShift * Decision::kBreathingShift);
    prior.information.diagonal().tail<3>().array() +=
        1 / (Decision::kBreathingTurn * Decision::kBreathingTurn);
    return prior;
}

SmallMotion sparsest(std::span<const HandleResiduals> kinds, const Eigen::VectorXd& weight,
                     const MotionPrior& prior) {
    constexpr double kLeastShare = 1e-3, kLargeMm = decisions::DeepMotion::kUnknownShift,
                     kLargeTurn = decisions::DeepMotion::kUnknownTurn;
    MotionPrior known = prior;
    // A row of handles does not tell all of a motion.
    if (known.information.isZero()) {
        known.information.diagonal().head<3>().setConstant(1 / (kLargeMm * kLargeMm));
        known.information.diagonal().tail<3>().setConstant(1 / (kLargeTurn * kLargeTurn));
    }
    SmallMotion motion = SmallMotion::Zero();
    for (int round = 0; round < kRounds; ++round) {
        Eigen::Matrix<double, 6, 6> sum = known.information;
        SmallMotion right = known.information * known.motion;
        for (const HandleResiduals& kind : kinds) {
            if (kind.share < kLeastShare) continue;
            const Eigen::VectorXd size = sizes(kind.values - kind.slope * motion);
            const double scale = std::max(kind.floor, weighted_median(size, weight));
            const Eigen::VectorXd now =
                kind.share / (scale * scale) * robust_weights(size, weight, scale);
            for (Eigen::Index i = 0; i < size.size(); ++i) {
                const auto rows = kind.slope.middleRows<3>(3 * i);
                sum += now[i] * rows.transpose() * rows;
                right += now[i] * rows.transpose() * kind.values.segment<3>(3 * i);
            }
        }
        const SmallMotion last = motion;
        motion = sum.ldlt().solve(right);
        const SmallMotion step = motion - last;
        if (step.head<3>().norm() < kStillMm && step.tail<3>().norm() < kStillTurn) break;
    }
    return motion.allFinite() ? motion : SmallMotion::Zero();
}

double median_size(const Eigen::VectorXd& values, const Eigen::VectorXd& weight) {
    return weighted_median(sizes(values), weight);
}

Eigen::Isometry3d as_motion(const SmallMotion& small) {
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    const Eigen::Vector3d turn = small.tail<3>();
    if (const double angle = turn.norm(); angle > 1e-12)
        motion.linear() = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
    motion.translation() = small.head<3>();
    return motion;
}

MotionSlope motion_slope(const Eigen::Matrix3Xd& points) {
    MotionSlope slope(3 * points.cols(), 6);
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
        slope.block<3, 3>(3 * i, 0).setIdentity();
        const Eigen::Vector3d x = points.col(i);
        slope.block<3, 3>(3 * i, 3) << 0, x.z(), -x.y(), -x.z(), 0, x.x(), x.y(), -x.x(), 0;
    }
    return slope;
}

}  // namespace defrec
