// What the normal equations of a hand-eye calibration say of its errors.
#pragma once
#include <vector>

#include "sdk/hand_eye/hand_eye.hpp"
#include "sdk/hand_eye/refinement.hpp"

namespace defrec {

struct HandEyeUncertainty {
    HandEyeMatrix covariance;  // as of HandEyeCalibration
    std::vector<HandEyeOpenMotion> open;
    double offset_sigma_s = 0;  // infinite where nothing tells the offset
    double length_factor = 1, length_factor_sigma = 0;
};

// variance_scale: what the covariance is to be multiplied by, of the residuals; a motion is open
// whose standard deviation exceeds max_error_mm.
HandEyeUncertainty hand_eye_uncertainty(const HandEyeFitted& fitted, bool has_offset,
                                        double variance_scale, double max_error_mm);

}  // namespace defrec
