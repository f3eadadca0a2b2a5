// By how much rows of the two rectified views differ.
#pragma once

#include <cmath>

#include "sdk/doctor/decisions.hpp"

namespace defrec::cli {

// RMS over the image, px, of a step at its middle, px, that grows linearly along x and y.
inline double row_error(double step, double along_x, double along_y, int width, int height) {
    return std::hypot(step, along_x * width / std::sqrt(12), along_y * height / std::sqrt(12));
}

// Frames are degraded where rows differ by so much; by more, most of the surface has no depth.
inline bool only_degrades(double row_error_px) {
    using Decision = decisions::DoctorViews;
    return row_error_px > Decision::kToldRowError && row_error_px <= Decision::kMaxRowError;
}

// It helps until the cameras are calibrated anew: 1.5 mm of 80, docs/experiments, row-errors.
inline constexpr char kSelfCalibrationHelp[] =
    "Until then, self_calibration: correct in --config of `defrec track` may help: more of the "
    "surface is tracked, and all depth may be off alike, by up to 2 %.";

}  // namespace defrec::cli
