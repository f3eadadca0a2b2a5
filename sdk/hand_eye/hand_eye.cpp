// See hand_eye.hpp.
#include "sdk/hand_eye/hand_eye.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "sdk/base/util/error.hpp"
#include "sdk/contract/descs.hpp"
#include "sdk/hand_eye/closed_form.hpp"
#include "sdk/hand_eye/decisions.hpp"
#include "sdk/hand_eye/pose_matching.hpp"
#include "sdk/hand_eye/refinement.hpp"
#include "sdk/hand_eye/rotation_spread.hpp"
#include "sdk/hand_eye/uncertainty.hpp"
#include "sdk/registration/pose.hpp"

namespace defrec {
namespace {

using decisions::HandEyeFit;
using decisions::HandEyeMotion;
using decisions::HandEyeNoiseStart;
using decisions::HandEyePoses;
using decisions::HandEyeVerdicts;

constexpr double kDegree = std::numbers::pi / 180;

// For sentences.
std::string digits(double value) {
    constexpr int kSignificant = 3;
    char text[32];
    return {text,
            std::to_chars(text, text + sizeof text, value, std::chars_format::general, kSignificant)
                .ptr};
}
std::string degrees(double turn) { return digits(turn / kDegree) + " degrees"; }

class Calibration {
  public:
    Calibration(const std::vector<TimedPose>& camera, const std::vector<TimedPose>& tracker,
                const HandEyeOptions& options)
        : matching_(camera, tracker, options), options_(options), poses_(camera.size()) {
        noise_ = options.noise.value_or(
            HandEyeNoise{HandEyeNoiseStart::kPlace, HandEyeNoiseStart::kTurn,
                         HandEyeNoiseStart::kPlace, HandEyeNoiseStart::kTurn});
    }

    HandEyeCalibration run() {
        if (match() && is_turned({}) && start() && fit()) conclude();
        return std::move(made_);
    }

  private:
    bool refuse(HandEyeVerdict verdict, const std::string& reason) {
        made_.verdict = verdict;
        made_.reason = reason;
        return false;
    }
    bool undetermined(const std::string& reason) {
        return refuse(HandEyeVerdict::kUndetermined, reason);
    }

    const HandEyePairs& pairs() const { return matching_.pairs(); }
    bool has_offset() const { return matching_.has_offset(); }

    bool match() {
        const std::string reason = matching_.match();
        made_.offset.correlation = matching_.correlation();
        made_.quality.poses = pairs().size();
        return reason.empty() || undetermined(reason);
    }

    bool is_turned(const std::vector<std::uint8_t>& is_used) {
        const RotationSpread spread = rotation_spread(pairs(), is_used);
        made_.quality.turn_rad = spread.turn;
        made_.quality.cross_turn_rad = spread.cross;
        const double least = HandEyeMotion::kNoiseRatio * noise_.tracker_rad;
        const double least_turn = std::max(HandEyeMotion::kMinTurn, least),
                     least_cross = std::max(HandEyeMotion::kMinCross, least);
        if (spread.turn < least_turn) {
            for (int i = 0; i < 3; ++i)
                made_.open.push_back({false, Eigen::Vector3d::Unit(i), HandEyeVerdicts::kExpected});
            return undetermined(concat(
                "the camera was turned by ", degrees(spread.turn), " (root mean square), expected ",
                degrees(least_turn),
                " at least: shifts alone do not tell where the camera is on the marker. Turn it by "
                "30 degrees or more, about several axes"));
        }
        if (spread.cross < least_cross) {
            made_.open.push_back({false, spread.axis, HandEyeVerdicts::kExpected});
            return undetermined(
                concat("all rotations are about one axis: across it the camera was turned by ",
                       degrees(spread.cross), " (root mean square), expected ",
                       degrees(least_cross), " at least. Open: ", made_.open.front().text(),
                       " of the marker's frame. Turn the camera about other axes, too"));
        }
        return true;
    }

    // The closed form, and whether it would fit better with one of the streams inverted.
    bool start() {
        const HandEyeStartFit begin = robust_start(pairs(), noise_);
        fitted_.transforms = begin.transforms;
        HandEyePairs inverted = pairs();
        for (HandEyePair& pair : inverted) pair.camera = pair.camera.inverse();
        const HandEyeStartFit other = robust_start(inverted, noise_);
        if (begin.median > HandEyeFit::kMedian &&
            other.median < HandEyeVerdicts::kInverted * begin.median)
            return refuse(
                HandEyeVerdict::kFailed,
                "one of both streams is inverted: the poses fit when the camera's, or the "
                "marker's, are read the other way round. Camera poses are to be the "
                "camera in its world, as world from camera; tracker poses the marker in "
                "the tracking system");
        const double factor = length_factor(pairs());
        if (factor > 0 && std::abs(factor - 1) > HandEyeVerdicts::kOtherUnit) {
            HandEyePairs scaled = pairs();
            for (HandEyePair& pair : scaled) pair.camera.translation() *= factor;
            if (begin.median > HandEyeFit::kMedian &&
                robust_start(scaled, noise_).median < HandEyeVerdicts::kInverted * begin.median)
                return refuse(
                    HandEyeVerdict::kFailed,
                    concat("the lengths of the camera's poses are to be multiplied by ",
                           digits(factor), " to be those of the tracker's: check both units"));
        }
        if (std::isfinite(begin.median)) return true;
        return undetermined("no two poses differ by a rotation that tells an axis");
    }

    HandEyeNoise fit_noise() const { return matching_.noise_of_pairs(noise_); }

    bool fit() {
        const int rounds = options_.noise && !has_offset() ? 1 : HandEyeNoiseStart::kRounds;
        for (int round = 0; round < rounds; ++round) {
            fitted_ = fit_hand_eye(pairs(), fitted_.transforms,
                                   {fit_noise(), options_.noise.has_value(), has_offset()});
            if (!options_.noise) estimate_noise();
            if (!has_offset() || round + 1 == rounds) continue;
            matching_.change_offset(fitted_.offset_change_s);
            made_.quality.poses = pairs().size();
            if (pairs().size() < HandEyePoses::kMinPoses)
                return undetermined("the streams overlap by too little at the offset that fits");
        }
        return true;
    }

    double freedom() const {
        return 6 * static_cast<double>(fitted_.inliers) - kHandEyeOffsetAt - (has_offset() ? 1 : 0);
    }

    // So that rotations and places have the residuals that are expected of them.
    void estimate_noise() {
        const double least = HandEyeVerdicts::kMinInliers * static_cast<double>(pairs().size());
        if (freedom() <= 0 || static_cast<double>(fitted_.inliers) < least) return;
        // Independent parts: rotations, and places with what the rotations say of them taken out.
        const HandEyeMatrix whitening = hand_eye_whitening(fit_noise(), fitted_.transforms);
        double turn = 0, place = 0;
        for (std::size_t i = 0; i < pairs().size(); ++i) {
            if (fitted_.is_inlier[i] == 0) continue;
            const HandEyeResidual residual = whitening * fitted_.residuals[i];
            turn += residual.head<3>().squaredNorm();
            place += residual.tail<3>().squaredNorm();
        }
        const double least_change = HandEyeNoiseStart::kMinChange;
        const auto change = [&](double squares) {
            return std::clamp(std::sqrt(2 * squares / freedom()), least_change, 1 / least_change);
        };
        for (double* each : {&noise_.camera_rad, &noise_.tracker_rad}) *each *= change(turn);
        for (double* each : {&noise_.camera_mm, &noise_.tracker_mm}) *each *= change(place);
    }

    // What the residuals say of the variances.
    double variance_scale() {
        const double free = freedom();
        if (free <= 0) return 1;
        const double ratio = fitted_.chi_squared / free;
        HandEyeQuality& quality = made_.quality;
        quality.error_ratio = std::sqrt(ratio);
        if (!options_.is_paired)
            quality.correlated =
                correlated_residuals(fitted_, hand_eye_whitening(fit_noise(), fitted_.transforms));
        const bool is_larger = ratio > 1 + HandEyeFit::kMinChange * std::sqrt(2 / free);
        if (options_.noise && is_larger)
            made_.notes.push_back("The residuals are " + digits(quality.error_ratio) +
                                  " times what the stated errors explain; the covariance says so.");
        return quality.correlated * (options_.noise && !is_larger ? 1 : ratio);
    }

    void conclude() {
        HandEyeQuality& quality = made_.quality;
        quality.inliers = fitted_.inliers;
        quality.rms_mm = fitted_.rms_mm;
        quality.rms_rad = fitted_.rms_rad;
        quality.noise = noise_;
        made_.transforms = fitted_.transforms;
        made_.offset.is_estimated = has_offset();
        made_.offset.offset_s = matching_.offset_s() + fitted_.offset_change_s;
        copy_residuals();
        const HandEyeUncertainty uncertainty =
            hand_eye_uncertainty(fitted_, has_offset(), variance_scale(), options_.max_error_mm);
        made_.covariance = uncertainty.covariance;
        made_.offset.sigma_s = uncertainty.offset_sigma_s;
        quality.length_factor = uncertainty.length_factor;
        quality.length_factor_sigma = uncertainty.length_factor_sigma;
        if (!fits()) return;
        if (!is_turned(fitted_.is_inlier)) {
            // What little there is of a rotation is noise, and tells nothing.
            for (const HandEyeOpenMotion& open : made_.open)
                made_.covariance.bottomRightCorner<3, 3>() += HandEyeVerdicts::kExpected *
                                                              HandEyeVerdicts::kExpected *
                                                              open.axis * open.axis.transpose();
        } else if (is_determined(uncertainty)) {
            made_.verdict = HandEyeVerdict::kSolved;
            made_.reason = "one transform fits, and the motion determines it";
            note_lengths();
        }
    }

    void copy_residuals() {
        const std::vector<std::size_t>& used = matching_.used();
        made_.residual_mm.assign(poses_, std::numeric_limits<double>::quiet_NaN());
        made_.residual_rad = made_.residual_mm;
        made_.is_inlier.assign(poses_, 0);
        for (std::size_t i = 0; i < used.size(); ++i) {
            made_.residual_rad[used[i]] = fitted_.residuals[i].head<3>().norm();
            made_.residual_mm[used[i]] = fitted_.residuals[i].tail<3>().norm();
            made_.is_inlier[used[i]] = fitted_.is_inlier[i];
        }
    }

    bool fits() {
        const double share =
            static_cast<double>(fitted_.inliers) / static_cast<double>(pairs().size());
        if (share < HandEyeVerdicts::kMinInliers || fitted_.inliers < HandEyePoses::kMinPoses)
            return refuse(HandEyeVerdict::kFailed,
                          concat("no transform fits: ", fitted_.inliers, " of ", pairs().size(),
                                 " poses agree with one. Do the poses belong together?"));
        if (!(fitted_.rms_mm <= options_.max_residual_mm) ||
            !(fitted_.rms_rad <= options_.max_residual_rad))
            return refuse(HandEyeVerdict::kFailed,
                          concat("no transform fits: the best one leaves ", digits(fitted_.rms_mm),
                                 " mm and ", degrees(fitted_.rms_rad),
                                 " (root mean square), at most ", digits(options_.max_residual_mm),
                                 " mm and ", degrees(options_.max_residual_rad), " were expected"));
        return true;
    }

    bool is_determined(const HandEyeUncertainty& uncertainty) {
        if (!uncertainty.open.empty()) {
            made_.open = uncertainty.open;
            std::string list;
            for (const HandEyeOpenMotion& open : made_.open)
                list += (list.empty() ? "" : ", ") + open.text();
            return undetermined("the motion does not determine the transform to within " +
                                digits(options_.max_error_mm) +
                                " mm. Open, in the marker's "
                                "frame: " +
                                list + ". Turn the camera farther, or take more poses");
        }
        if (has_offset() && !(made_.offset.sigma_s <= options_.max_offset_error_s))
            return undetermined(concat(
                "the motion does not show the offset between both clocks: its standard deviation "
                "is ",
                digits(1000 * made_.offset.sigma_s), " ms, expected at most ",
                digits(1000 * options_.max_offset_error_s), " ms. Move the camera faster"));
        return true;
    }

    void note_lengths() {
        const HandEyeQuality& quality = made_.quality;
        const double away = std::abs(quality.length_factor - 1);
        if (away < HandEyeVerdicts::kLengths ||
            away < HandEyeVerdicts::kLengthsSure * quality.length_factor_sigma)
            return;
        made_.notes.push_back(concat(
            "Lengths of the camera's poses are ", quality.length_factor > 1 ? "shorter" : "longer",
            " than the tracker's by ", digits(100 * away),
            " %: check the size of the board, or the baseline of the calibration."));
    }

    PoseMatching matching_;
    const HandEyeOptions& options_;
    std::size_t poses_;  // of the camera
    HandEyeNoise noise_;
    HandEyeFitted fitted_;
    HandEyeCalibration made_;
};

}  // namespace

HandEyeOptions::HandEyeOptions() {
    defrec_hand_eye_desc desc{};
    fill_defaults(desc);
    max_offset_s = desc.max_offset_s;
    max_residual_mm = desc.max_residual_mm;
    max_residual_rad = desc.max_residual_rad;
    max_error_mm = desc.max_error_mm;
    max_offset_error_s = desc.max_offset_error_s;
}

const char* name_of(HandEyeVerdict verdict) {
    switch (verdict) {
        case HandEyeVerdict::kSolved:
            return "solved";
        case HandEyeVerdict::kUndetermined:
            return "undetermined";
        default:
            return "failed";
    }
}

HandEyeCalibration calibrate_hand_eye(const std::vector<TimedPose>& camera,
                                      const std::vector<TimedPose>& tracker,
                                      const HandEyeOptions& options) {
    return Calibration(camera, tracker, options).run();
}

HandEyeMatrix HandEyeCalibration::pose_covariance(const Eigen::Isometry3d& marker) const {
    // About the marker's place: the calibration's error, turned, and the marker's own.
    HandEyeMatrix turned = HandEyeMatrix::Zero();
    turned.topLeftCorner<3, 3>() = turned.bottomRightCorner<3, 3>() = marker.rotation();
    HandEyeMatrix error = turned * covariance * turned.transpose();
    error.diagonal().head<3>().array() += quality.noise.tracker_rad * quality.noise.tracker_rad;
    error.diagonal().tail<3>().array() += quality.noise.tracker_mm * quality.noise.tracker_mm;
    // About the camera's.
    HandEyeMatrix moved = HandEyeMatrix::Identity();
    moved.bottomRows<3>() =
        place_shift(marker.rotation() * transforms.marker_from_camera.translation());
    return moved * error * moved.transpose();
}

}  // namespace defrec
