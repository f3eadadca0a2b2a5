// See deep_motion.hpp.
#include "sdk/body/deep_motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "backends/shared/rigid_fit.hpp"
#include "sdk/body/decisions.hpp"

namespace defrec {
namespace {

constexpr int kRounds = 16;  // of reweighting, at most
// Variance across a row of points, in that along it, that tells how it turns about itself.
constexpr double kLeastSpread = 2e-3;
constexpr double kStillMm = 1e-4, kStillTurn = 1e-6;  // steps that change nothing

// The weight of values up to a limit.
double weight_within(const Eigen::VectorXd& values, const Eigen::VectorXd& weight, double limit) {
    // Several sums at once: an addition need not wait for the last one.
    constexpr Eigen::Index kSums = 4;
    std::array<double, kSums> sums{};
    const Eigen::Index even = values.size() / kSums * kSums;
    for (Eigen::Index first = 0; first < even; first += kSums)
        for (Eigen::Index i = 0; i < kSums; ++i)
            sums[static_cast<size_t>(i)] += values[first + i] <= limit ? weight[first + i] : 0;
    for (Eigen::Index i = even; i < values.size(); ++i)
        sums[static_cast<size_t>(i - even)] += values[i] <= limit ? weight[i] : 0;
    return sums[0] + sums[1] + (sums[2] + sums[3]);
}

// The value that half of the weight does not exceed; 0 for none.
double weighted_median(const Eigen::VectorXd& values, const Eigen::VectorXd& weight) {
    // By bisection, which sorts nothing.
    if (values.size() == 0) return 0;
    constexpr int kHalvings = 14;
    double low = 0, high = values.maxCoeff();
    const double half = weight.sum() / 2;
    for (int round = 0; round < kHalvings; ++round) {
        const double middle = (low + high) / 2;
        (weight_within(values, weight, middle) >= half ? high : low) = middle;
    }
    return high;
}

// Weights after Geman and McClure: 1 for a residual of 0, a quarter for one of that scale.
Eigen::VectorXd robust_weights(const Eigen::VectorXd& residual, const Eigen::VectorXd& weight,
                               double scale) {
    return weight.array() / (1 + (residual.array() / scale).square()).square();
}

// Residuals of one kind as quadratic forms of the motion: its rounds need no slopes.
class QuadraticResiduals {
  public:
    explicit QuadraticResiduals(const HandleResiduals& kind)
        : floor_(kind.floor), share_(kind.share), terms_(kind.values.size() / 3, kTerms) {
        for (Eigen::Index i = 0; i < terms_.rows(); ++i) {
            const Eigen::Matrix<double, 3, 6> slope = kind.slope.middleRows<3>(3 * i);
            const Eigen::Vector3d value = kind.values.segment<3>(3 * i);
            terms_(i, 0) = value.squaredNorm();
            Eigen::Index term = 1;
            for (Eigen::Index a = 0; a < 6; ++a) terms_(i, term++) = slope.col(a).dot(value);
            for (Eigen::Index a = 0; a < 6; ++a)
                for (Eigen::Index b = a; b < 6; ++b)
                    terms_(i, term++) = slope.col(a).dot(slope.col(b));
        }
    }
    // Adds the normal equations of the handles, weighted by the residuals that a motion leaves.
    void add(const SmallMotion& motion, const Eigen::VectorXd& weight,
             Eigen::Matrix<double, 6, 6>& sum, SmallMotion& right) const {
        const Eigen::VectorXd size = sizes(motion);
        const double scale = std::max(floor_, weighted_median(size, weight));
        const Terms sums =
            share_ / (scale * scale) * (terms_.transpose() * robust_weights(size, weight, scale));
        right += sums.segment<6>(1);
        Eigen::Index term = 7;
        for (Eigen::Index a = 0; a < 6; ++a)
            for (Eigen::Index b = a; b < 6; ++b, ++term) {
                sum(a, b) += sums[term];
                if (a != b) sum(b, a) += sums[term];
            }
    }

  private:
    static constexpr int kTerms = 28;
    using Terms = Eigen::Matrix<double, kTerms, 1>;

    // Lengths of the residuals that a motion leaves.
    Eigen::VectorXd sizes(const SmallMotion& motion) const {
        Terms factors;
        factors[0] = 1;
        factors.segment<6>(1) = -2 * motion;
        Eigen::Index term = 7;
        for (Eigen::Index a = 0; a < 6; ++a)
            for (Eigen::Index b = a; b < 6; ++b)
                factors[term++] = (a == b ? 1 : 2) * motion[a] * motion[b];
        return (terms_ * factors).cwiseMax(0.0).cwiseSqrt();
    }

    double floor_, share_;
    // Per handle: the squared value, slope^T value, and slope^T slope's upper half, row by row.
    Eigen::Matrix<double, Eigen::Dynamic, kTerms> terms_;
};

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
    std::vector<QuadraticResiduals> quadratic;
    for (const HandleResiduals& kind : kinds)
        if (kind.share >= kLeastShare) quadratic.emplace_back(kind);
    SmallMotion motion = SmallMotion::Zero();
    for (int round = 0; round < kRounds; ++round) {
        Eigen::Matrix<double, 6, 6> sum = known.information;
        SmallMotion right = known.information * known.motion;
        for (const QuadraticResiduals& kind : quadratic) kind.add(motion, weight, sum, right);
        const SmallMotion last = motion;
        motion = sum.ldlt().solve(right);
        const SmallMotion step = motion - last;
        if (step.head<3>().norm() < kStillMm && step.tail<3>().norm() < kStillTurn) break;
    }
    return motion.allFinite() ? motion : SmallMotion::Zero();
}

double median_size(const Eigen::VectorXd& values, const Eigen::VectorXd& weight) {
    const Eigen::Map<const Eigen::Matrix3Xd> vectors(values.data(), 3, values.size() / 3);
    return weighted_median(vectors.colwise().norm(), weight);
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
