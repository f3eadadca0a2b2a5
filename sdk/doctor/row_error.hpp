// By how much rows of the two rectified views differ.
#pragma once

#include <cmath>

namespace defrec::cli {

// RMS over the image, px, of a step at its middle, px, that grows linearly along x and y.
inline double row_error(double step, double along_x, double along_y, int width, int height) {
    return std::hypot(step, along_x * width / std::sqrt(12), along_y * height / std::sqrt(12));
}

}  // namespace defrec::cli
