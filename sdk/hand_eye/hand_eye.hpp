// Hand-eye calibration: where a camera is in the frame of the marker that a tracking system sees on
// it, from poses of both. How exactly it is known, how much later one clock is than the other, and
// whether the result may be used.
#pragma once
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sdk/hand_eye/hand_eye_pair.hpp"
#include "sdk/hand_eye/pose_stream.hpp"

namespace defrec {

struct HandEyeOptions {
    std::optional<HandEyeNoise> noise;  // absent: the residuals say how large it is
    bool is_paired = false;             // pose i of both belong together, whatever their times
    // Tracking system's time = camera's time + offset, s; absent: it is estimated. Not of pairs.
    std::optional<double> offset_s;
    double max_offset_s;
    double max_residual_mm;
    double max_residual_rad;
    double max_error_mm;
    double max_offset_error_s;

    HandEyeOptions();  // defaults of defrec_hand_eye_desc
};

enum class HandEyeVerdict {
    kSolved,
    kUndetermined,  // the motion does not determine the transform, or the offset
    kFailed         // no transform fits
};

// A motion of the transform that the poses do not tell from rest: of the camera in the marker's
// frame, a turn about its own place or a shift.
struct HandEyeOpenMotion {
    bool is_turn = false;
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // unit length, in the marker's frame
    double expected = 0;                              // standard deviation, rad or mm

    std::string text() const;  // "shift along (1 0 0)"
};

struct HandEyeOffsetResult {
    bool is_estimated = false;
    double offset_s = 0;
    double sigma_s = 0;      // standard deviation
    double correlation = 0;  // of rotation speeds
};

struct HandEyeQuality {
    double rms_mm = 0, rms_rad = 0;  // residuals of the poses that fit, at the camera
    double error_ratio = 0;          // residuals, in units of the stated or estimated errors
    HandEyeNoise noise{};            // these errors
    double correlated = 1;           // so many neighbours have one error
    std::uint64_t poses = 0;         // that were used
    std::uint64_t inliers = 0;       // of them, that fit
    double turn_rad = 0;             // root mean square of the rotations against their mean
    double cross_turn_rad = 0;       // that of their parts across the main axis
    // The world's lengths are to be multiplied by it to have those of the tracking system.
    double length_factor = 1, length_factor_sigma = 0;
};

struct HandEyeCalibration {
    HandEyeVerdict verdict = HandEyeVerdict::kFailed;
    std::string reason;  // one sentence
    HandEyeTransforms transforms;
    // Covariance of the motion that the true marker_from_camera has after the one found: a turn in
    // rad about x, y, z of the marker's frame and about its origin, then a shift in mm. NaN where
    // it was refused before anything was solved; then residual_mm is empty.
    HandEyeMatrix covariance = HandEyeMatrix::Constant(std::numeric_limits<double>::quiet_NaN());
    std::vector<HandEyeOpenMotion> open;
    HandEyeOffsetResult offset;
    HandEyeQuality quality;
    std::vector<std::string> notes;  // sentences
    // For each pose of the camera: at the camera, NaN where it was not used.
    std::vector<double> residual_mm, residual_rad;
    std::vector<std::uint8_t> is_inlier;

    // Covariance of the motion that the true pose of the camera has after the one that follows from
    // a pose of the marker, tracking system from marker: a turn in rad about x, y, z of the
    // tracking system and about the camera's place, then a shift in mm.
    HandEyeMatrix pose_covariance(const Eigen::Isometry3d& marker) const;
};

const char* name_of(HandEyeVerdict verdict);

// camera: world from camera, of a world that is fixed to the tracking system; tracker: tracking
// system from marker. Throws Error for poses and times that are none; options are within the ranges
// of defrec_hand_eye_desc.
HandEyeCalibration calibrate_hand_eye(const std::vector<TimedPose>& camera,
                                      const std::vector<TimedPose>& tracker,
                                      const HandEyeOptions& options);

}  // namespace defrec
