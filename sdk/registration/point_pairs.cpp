// See point_pairs.hpp. Starts with the closed form by unit quaternions (Horn, Closed-form solution
// of absolute orientation using unit quaternions, J. Opt. Soc. Am. A 4, 1987), each pair weighted
// by its mean variance; then weighted least squares with the whole covariances of both places, by
// Gauss and Newton. Pairs whose errors are not stated are scaled by their residuals (Student's t
// for the few degrees of freedom), others where they contradict what was stated (Birge, 1932).
#include "sdk/registration/point_pairs.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "sdk/base/util/error.hpp"
#include "sdk/contract/descs.hpp"
#include "sdk/registration/decisions.hpp"

namespace defrec {
namespace {

using decisions::RegistrationPairs;

bool is_zero(const PointPair& pair) {
    return pair.model_covariance.isZero(0) && pair.seen_covariance.isZero(0);
}

void check_place(const Eigen::Vector3d& place, size_t index, const char* which) {
    if (!place.allFinite())
        fail(DEFREC_ERROR_ARGUMENT, "pair ", index, " has a coordinate that is not finite");
    const double farthest = place.cwiseAbs().maxCoeff();
    if (farthest > RegistrationPairs::kFarthest)
        fail(DEFREC_ERROR_ARGUMENT, "pair ", index, ": a coordinate of its ", which, " place is ",
             farthest, " mm from 0, expected ", RegistrationPairs::kFarthest, " at most");
}

void check_covariance(const Eigen::Matrix3d& covariance, size_t index, const char* which) {
    const double size = covariance.cwiseAbs().maxCoeff();
    const bool is_one =
        covariance.allFinite() &&
        covariance.isApprox(covariance.transpose(), RegistrationPairs::kSymmetric) &&
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues()[0] >=
            -RegistrationPairs::kRounding * size;
    if (!is_one && !covariance.isZero(0))
        fail(DEFREC_ERROR_ARGUMENT, "pair ", index, ": the covariance of its ", which,
             " place is none, expected a symmetric matrix without negative eigenvalues, mm^2");
    constexpr double kMost = RegistrationPairs::kFarthest * RegistrationPairs::kFarthest;
    if (size > kMost)
        fail(DEFREC_ERROR_ARGUMENT, "pair ", index, ": a variance of its ", which, " place is ",
             size, " mm^2, expected ", kMost, " at most");
}

// Whether their errors are stated.
bool check_pairs(std::span<const PointPair> pairs) {
    if (pairs.size() < RegistrationPairs::kMinPairs)
        fail(DEFREC_ERROR_ARGUMENT, pairs.size(), " pairs were given, expected ",
             RegistrationPairs::kMinPairs, " at least: fewer do not tell how the model is turned");
    size_t stated = 0;
    for (size_t i = 0; i < pairs.size(); ++i) {
        check_place(pairs[i].model, i, "model's");
        check_place(pairs[i].seen, i, "seen");
        check_covariance(pairs[i].model_covariance, i, "model's");
        check_covariance(pairs[i].seen_covariance, i, "seen");
        stated += !is_zero(pairs[i]);
    }
    if (stated != 0 && stated != pairs.size())
        fail(DEFREC_ERROR_ARGUMENT, "the errors of ", stated, " of ", pairs.size(),
             " pairs are stated, expected those of all or of none");
    return stated != 0;
}

class PairFit {
  public:
    PairFit(std::span<const PointPair> pairs, bool is_stated)
        : pairs_(pairs), is_stated_(is_stated), weight_(pairs.size(), 1) {
        if (is_stated)
            for (size_t i = 0; i < pairs.size(); ++i)
                weight_[i] = 3 / (pairs[i].model_covariance + pairs[i].seen_covariance).trace();
        pose_ = closed_form();
        for (int round = 0; round < RegistrationPairs::kRounds && is_stated_; ++round) improve();
    }

    const Pose& pose() const { return pose_; }
    Eigen::Vector3d residual(size_t i) const { return pairs_[i].seen - pose_ * pairs_[i].model; }
    // Squared length of a residual in units of its expected error, 3 on average.
    double squared_ratio(size_t i) const {
        return residual(i).dot(inverse_covariance(i) * residual(i));
    }

    PoseInformation information() const {
        PoseInformation made;
        made.centre = centre_of([&](size_t i) { return pose_ * pairs_[i].model; });
        double squared = 0, sum = 0;
        for (size_t i = 0; i < pairs_.size(); ++i) {
            squared += weight_[i] * (pose_ * pairs_[i].model - made.centre).squaredNorm();
            sum += weight_[i];
        }
        made.length = std::max(std::sqrt(squared / sum), RegistrationPairs::kMinLength);
        for (size_t i = 0; i < pairs_.size(); ++i) {
            Eigen::Matrix<double, 3, 6> gradient =
                place_shift(pose_ * pairs_[i].model - made.centre);
            gradient.leftCols<3>() /= made.length;
            made.matrix += gradient.transpose() * inverse_covariance(i) * gradient;
        }
        return made;
    }

  private:
    template <class Place>
    Eigen::Vector3d centre_of(const Place& place) const {
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();
        double sum = 0;
        for (size_t i = 0; i < pairs_.size(); ++i) {
            centre += weight_[i] * place(i);
            sum += weight_[i];
        }
        return centre / sum;
    }

    // Horn's quaternion: the eigenvector to the largest eigenvalue of a matrix of the products.
    Pose closed_form() const {
        const Eigen::Vector3d model = centre_of([&](size_t i) { return pairs_[i].model; });
        const Eigen::Vector3d seen = centre_of([&](size_t i) { return pairs_[i].seen; });
        Eigen::Matrix3d s = Eigen::Matrix3d::Zero();
        for (size_t i = 0; i < pairs_.size(); ++i)
            s += weight_[i] * (pairs_[i].model - model) * (pairs_[i].seen - seen).transpose();
        Eigen::Matrix4d n;
        n(0, 0) = s.trace();
        n.block<3, 1>(1, 0) << s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0);
        n.block<1, 3>(0, 1) = n.block<3, 1>(1, 0).transpose();
        n.bottomRightCorner<3, 3>() = s + s.transpose() - s.trace() * Eigen::Matrix3d::Identity();
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(n);
        const Eigen::Vector4d q = solver.eigenvectors().col(3);
        Pose pose;
        pose.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
        pose.translation = seen - pose.rotation * model;
        return pose;
    }

    Eigen::Matrix3d inverse_covariance(size_t i) const {
        if (!is_stated_) return Eigen::Matrix3d::Identity();
        Eigen::Matrix3d covariance = pairs_[i].seen_covariance + pose_.rotation *
                                                                     pairs_[i].model_covariance *
                                                                     pose_.rotation.transpose();
        covariance.diagonal().array() +=
            RegistrationPairs::kRounding * covariance.trace() +
            RegistrationPairs::kMinError * RegistrationPairs::kMinError;
        return covariance.inverse();
    }

    void improve() {
        const PoseInformation at = information();
        Twist right = Twist::Zero();
        for (size_t i = 0; i < pairs_.size(); ++i) {
            Eigen::Matrix<double, 3, 6> gradient = place_shift(pose_ * pairs_[i].model - at.centre);
            gradient.leftCols<3>() /= at.length;
            right += gradient.transpose() * inverse_covariance(i) * residual(i);
        }
        TwistMatrix matrix = at.matrix;
        matrix.diagonal().array() += RegistrationPairs::kRounding * matrix.trace();
        Twist step = matrix.ldlt().solve(right);
        step.head<3>() /= at.length;
        pose_ = moved(pose_, step, at.centre);
    }

    std::span<const PointPair> pairs_;
    bool is_stated_;
    std::vector<double> weight_;  // 1 / mm^2
    Pose pose_;
};

// The worst pair that is too far off for its error; the number of pairs for none.
size_t contradicting_pair(const PairFit& fit, size_t count, bool is_stated, double variance_scale) {
    size_t worst = count;
    double most = is_stated ? RegistrationPairs::kMaxRatio * RegistrationPairs::kMaxRatio
                            : RegistrationPairs::kMaxUnstatedRatio * variance_scale;
    for (size_t i = 0; i < count; ++i) {
        if (fit.squared_ratio(i) <= most) continue;
        most = fit.squared_ratio(i);
        worst = i;
    }
    return worst;
}

void judge(Registration& result, const PairFit& fit, const PairOptions& options, size_t wrong) {
    const size_t count = result.residual_mm.size();
    const auto shown = [](double value) {
        return static_cast<float>(std::round(100 * value) / 100);
    };
    result.verdict = RegistrationVerdict::kFailed;
    if (result.residuals.rms_mm > options.max_residual_mm) {
        result.reason = concat("the pairs do not fit each other: they are off by ",
                               shown(result.residuals.rms_mm), " mm, ",
                               shown(options.max_residual_mm), " at most were expected");
    } else if (wrong < count) {
        result.reason = concat("pair ", wrong, " contradicts the others: it is off by ",
                               shown(result.residual_mm[wrong]), " mm, ",
                               shown(std::sqrt(fit.squared_ratio(wrong))), " times its error");
    } else if (!result.free.empty()) {
        result.verdict = RegistrationVerdict::kUndetermined;
        result.reason = concat("the pairs leave open a ", result.free.front().text());
    } else {
        result.verdict = RegistrationVerdict::kRegistered;
        result.reason = concat(count, " pairs agree to ", shown(result.residuals.rms_mm), " mm");
    }
}

}  // namespace

PairOptions::PairOptions() {
    defrec_registration_pairs desc{};
    fill_defaults(desc);
    max_error_mm = desc.max_error_mm;
    max_residual_mm = desc.max_residual_mm;
}

Registration register_pairs(std::span<const PointPair> pairs, const PairOptions& options) {
    const bool is_stated = check_pairs(pairs);
    const PairFit fit(pairs, is_stated);
    Registration result;
    result.pose = fit.pose();
    const auto count = static_cast<double>(pairs.size());
    double squared = 0, ratios = 0;
    for (size_t i = 0; i < pairs.size(); ++i) {
        squared += fit.residual(i).squaredNorm();
        ratios += fit.squared_ratio(i);
        result.residual_mm.push_back(static_cast<float>(fit.residual(i).norm()));
    }
    const double freedom = 3 * count - 6;
    PoseInformation information = fit.information();
    // A variance that is estimated from few residuals has a wider distribution of Student.
    information.variance_scale =
        is_stated ? std::max(1.0, ratios / freedom) : ratios / freedom * freedom / (freedom - 2);
    const double whole = information.matrix.trace() / 6;
    const PoseUncertainty uncertainty =
        uncertainty_of(information, whole, RegistrationPairs::kMinShare, options.max_error_mm);
    result.covariance = uncertainty.covariance;
    result.free = uncertainty.free;
    result.residuals = {std::sqrt(squared / count),
                        std::sqrt(squared / (3 * count)),
                        std::sqrt(ratios / (3 * count)),
                        1,
                        1,
                        pairs.size()};
    const size_t wrong = contradicting_pair(fit, pairs.size(), is_stated, ratios / freedom);
    result.is_inlier.assign(pairs.size(), 1);
    if (wrong < pairs.size()) {
        result.is_inlier[wrong] = 0;
        result.residuals.inlier_share = 1 - 1 / count;
    }
    judge(result, fit, options, wrong);
    return result;
}

}  // namespace defrec
