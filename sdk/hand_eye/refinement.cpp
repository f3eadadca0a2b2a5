// See refinement.hpp.
#include "sdk/hand_eye/refinement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "sdk/hand_eye/cross_matrix.hpp"
#include "sdk/hand_eye/decisions.hpp"
#include "sdk/hand_eye/pose_stream.hpp"

namespace defrec {
namespace {

using decisions::HandEyeFit;
using Rows = Eigen::Matrix<double, 6, kHandEyeParameters>;

// The residual's derivatives by the parameters.
Rows jacobian_of(const HandEyePair& pair, const HandEyeTransforms& transforms) {
    const Eigen::Isometry3d &x = transforms.marker_from_camera, &z = transforms.tracker_from_world;
    const Eigen::Matrix3d camera_from_tracker =
                              pair.camera.linear().transpose() * z.linear().transpose(),
                          marker = pair.tracker.linear();
    const Eigen::Vector3d camera = pair.tracker * x.translation();
    Rows rows = Rows::Zero();
    rows.block<3, 3>(0, 0) = x.linear().transpose() / HandEyeFit::kLength;
    rows.block<3, 3>(3, 3) = camera_from_tracker * marker;
    rows.block<3, 3>(0, 6) = -(marker * x.linear()).transpose() / HandEyeFit::kLength;
    rows.block<3, 3>(3, 6) =
        camera_from_tracker * cross_matrix(camera - z.translation()) / HandEyeFit::kLength;
    rows.block<3, 3>(3, 9) = -camera_from_tracker;
    rows.block<3, 1>(0, kHandEyeOffsetAt) = x.linear().transpose() * pair.turn_rate;
    rows.block<3, 1>(3, kHandEyeOffsetAt) =
        camera_from_tracker * (pair.velocity + marker * pair.turn_rate.cross(x.translation()));
    rows.block<3, 1>(3, kHandEyeFactorAt) =
        -(pair.camera.linear().transpose() * pair.camera.translation());
    return rows;
}

void turn_and_shift(Eigen::Isometry3d& pose, const HandEyeResidual& step) {
    const Eigen::Matrix3d turned =
        rotation_of(step.head<3>() / HandEyeFit::kLength) * pose.linear();
    // Rounding adds up over the steps.
    pose.linear() = Eigen::Quaterniond(turned).normalized().toRotationMatrix();
    pose.translation() += step.tail<3>();
}

class Fit {
  public:
    Fit(const HandEyePairs& pairs, const HandEyeTransforms& start, const HandEyeFitOptions& options)
        : pairs_(pairs), options_(options) {
        fitted_.transforms = start;
        fitted_.is_inlier.assign(pairs.size(), 1);
    }

    HandEyeFitted run() {
        for (int round = 0; round < HandEyeFit::kRounds; ++round) {
            if (!choose() && round > 0) break;
            for (int i = 0; i < HandEyeFit::kSteps; ++i)
                if (step() < HandEyeFit::kRest) break;
        }
        sum_up();
        return std::move(fitted_);
    }

  private:
    // Which poses count; false: the same as before.
    bool choose() {
        const HandEyeMatrix whitening = hand_eye_whitening(options_.noise, fitted_.transforms);
        std::vector<double> errors, sorted;
        for (const HandEyePair& pair : pairs_)
            errors.push_back((whitening * hand_eye_residual(pair, fitted_.transforms)).norm());
        sorted = errors;
        const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
        std::nth_element(sorted.begin(), middle, sorted.end());
        double scale = *middle / HandEyeFit::kMedian * small_sample_factor();
        if (options_.is_noise_stated) scale = std::max(scale, 1.0);
        bool is_changed = false;
        for (std::size_t i = 0; i < errors.size(); ++i) {
            const std::uint8_t fits = errors[i] <= HandEyeFit::kInlier * scale ? 1 : 0;
            is_changed = is_changed || fits != fitted_.is_inlier[i];
            fitted_.is_inlier[i] = fits;
        }
        return is_changed;
    }

    // The median of few errors is too small, because the transform was fitted to them.
    double small_sample_factor() const {
        const auto count = static_cast<double>(pairs_.size());
        return 1 + HandEyeFit::kSmallSample / std::max(1.0, count - 2);
    }

    void add_up() {
        const HandEyeMatrix whitening = hand_eye_whitening(options_.noise, fitted_.transforms);
        fitted_.information.setZero();
        fitted_.gradient.setZero();
        fitted_.chi_squared = 0;
        for (std::size_t i = 0; i < pairs_.size(); ++i) {
            if (fitted_.is_inlier[i] == 0) continue;
            const Rows rows = whitening * jacobian_of(pairs_[i], fitted_.transforms);
            const HandEyeResidual residual =
                whitening * hand_eye_residual(pairs_[i], fitted_.transforms);
            fitted_.information += rows.transpose() * rows;
            fitted_.gradient += rows.transpose() * residual;
            fitted_.chi_squared += residual.squaredNorm();
        }
    }

    // Returns its length, mm; the offset counts by how far the camera moves in it.
    double step() {
        add_up();
        const int count = options_.has_offset ? kHandEyeOffsetAt + 1 : kHandEyeOffsetAt;
        Eigen::MatrixXd normal = fitted_.information.topLeftCorner(count, count);
        normal.diagonal().array() += HandEyeFit::kDamping * normal.diagonal().maxCoeff();
        const Eigen::VectorXd change = -normal.ldlt().solve(fitted_.gradient.head(count));
        if (!change.allFinite()) return 0;
        turn_and_shift(fitted_.transforms.marker_from_camera, change.head<6>());
        turn_and_shift(fitted_.transforms.tracker_from_world, change.segment<6>(6));
        double length = change.head<kHandEyeOffsetAt>().norm();
        if (options_.has_offset) {
            const double later = change[kHandEyeOffsetAt];
            shift_time(later);
            length += std::abs(later) * HandEyeFit::kLength;
        }
        return length;
    }

    void shift_time(double later) {
        fitted_.offset_change_s += later;
        for (HandEyePair& pair : pairs_) {
            pair.tracker.linear() = pair.tracker.linear() * rotation_of(later * pair.turn_rate);
            pair.tracker.translation() += later * pair.velocity;
        }
    }

    void sum_up() {
        add_up();
        double turn = 0, place = 0;
        for (std::size_t i = 0; i < pairs_.size(); ++i) {
            fitted_.residuals.push_back(hand_eye_residual(pairs_[i], fitted_.transforms));
            if (fitted_.is_inlier[i] == 0) continue;
            ++fitted_.inliers;
            turn += fitted_.residuals[i].head<3>().squaredNorm();
            place += fitted_.residuals[i].tail<3>().squaredNorm();
        }
        if (fitted_.inliers == 0) return;
        fitted_.rms_rad = std::sqrt(turn / static_cast<double>(fitted_.inliers));
        fitted_.rms_mm = std::sqrt(place / static_cast<double>(fitted_.inliers));
    }

    HandEyePairs pairs_;
    HandEyeFitOptions options_;
    HandEyeFitted fitted_;
};

}  // namespace

HandEyeFitted fit_hand_eye(const HandEyePairs& pairs, const HandEyeTransforms& start,
                           const HandEyeFitOptions& options) {
    return Fit(pairs, start, options).run();
}

double correlated_residuals(const HandEyeFitted& fitted, const HandEyeMatrix& whitening) {
    std::vector<HandEyeResidual> residuals;
    double square = 0;
    for (std::size_t i = 0; i < fitted.residuals.size(); ++i) {
        if (fitted.is_inlier[i] == 0) continue;
        residuals.emplace_back(whitening * fitted.residuals[i]);
        square += residuals.back().squaredNorm();
    }
    if (residuals.size() < HandEyeFit::kMinCorrelated || !(square > 0)) return 1;
    square /= static_cast<double>(residuals.size());
    double count = 1;
    for (std::size_t away = 1; away < residuals.size() / 2; ++away) {
        double sum = 0;
        for (std::size_t i = 0; i + away < residuals.size(); ++i)
            sum += residuals[i].dot(residuals[i + away]);
        const double correlation = sum / (square * static_cast<double>(residuals.size() - away));
        if (correlation < HandEyeFit::kFaded) break;
        count += 2 * correlation;
    }
    return count;
}

}  // namespace defrec
