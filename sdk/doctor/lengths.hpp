// Whether lengths of a calibration are those of an instrument.
#pragma once

#include <cmath>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/evidence.hpp"

namespace defrec::cli {

inline double baseline_of(const StereoCalibration& calibration) {
    const auto& t = calibration.translation;
    return std::hypot(t[0], t[1], t[2]);
}

// depth_mm: 0 where it is not known.
inline bool are_plausible(double baseline_mm, double depth_mm) {
    using Decision = decisions::DoctorLengths;
    return baseline_mm >= Decision::kMinBaseline && baseline_mm <= Decision::kMaxBaseline &&
           (depth_mm == 0 || (depth_mm >= Decision::kMinDepth && depth_mm <= Decision::kMaxDepth));
}

// By the calibration as it is given, 0: not known.
inline double depth_of(const Evidence& evidence) {
    return evidence.has_depth() ? evidence.as_given().depth_mm : 0;
}

}  // namespace defrec::cli
