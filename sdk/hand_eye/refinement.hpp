// Least squares of both transforms of AX = ZB, and of the offset between the clocks, over the poses
// that agree (Gauss and Newton's method; the choice of poses as of reweighted least squares in P.
// Rousseeuw, A. Leroy, "Robust regression and outlier detection", 1987).
#pragma once
#include <cstdint>
#include <vector>

#include "sdk/hand_eye/hand_eye_pair.hpp"

namespace defrec {

struct HandEyeFitOptions {
    HandEyeNoise noise;
    bool is_noise_stated = true;  // an error is no smaller than it
    bool has_offset = false;      // the offset is estimated as well
};

// Parameters: the marker from the camera, the world in the tracking system, each a turn times
// HandEyeFit::kLength, then a shift, all mm; then the offset, s; then the factor of the world's
// lengths, which is not changed.
constexpr int kHandEyeParameters = 14, kHandEyeOffsetAt = 12, kHandEyeFactorAt = 13;
using HandEyeInformation = Eigen::Matrix<double, kHandEyeParameters, kHandEyeParameters>;
using HandEyeGradient = Eigen::Matrix<double, kHandEyeParameters, 1>;

struct HandEyeFitted {
    HandEyeTransforms transforms;
    double offset_change_s = 0;
    std::vector<HandEyeResidual> residuals;
    std::vector<std::uint8_t> is_inlier;
    HandEyeInformation information = HandEyeInformation::Zero();  // of the inliers
    HandEyeGradient gradient = HandEyeGradient::Zero();
    double chi_squared = 0;
    std::size_t inliers = 0;
    double rms_mm = 0, rms_rad = 0;  // of the inliers
};

HandEyeFitted fit_hand_eye(const HandEyePairs& pairs, const HandEyeTransforms& start,
                           const HandEyeFitOptions& options);

// How many residuals of neighbours count as one: 1 where they are independent.
double correlated_residuals(const HandEyeFitted& fitted, const HandEyeMatrix& whitening);

}  // namespace defrec
