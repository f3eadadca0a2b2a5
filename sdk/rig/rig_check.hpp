// What a calibration must fulfil before anything is computed from it (faults rows 1-9 and 109).
#pragma once
#include <Eigen/Core>
#include <cstdint>

#include "include/defrec_c.h"
#include "sdk/base/os/services.hpp"

namespace defrec {

// desc: struct_size settled. Throws Error(DEFREC_ERROR_ARGUMENT), or DEFREC_ERROR_UNSUPPORTED for a
// baseline that is not horizontal, with an error message that names the field. Logs a warning where
// a distortion folds within the image, or numbers are those of hardly any camera.
void check_rig(const Services& services, const defrec_rig_desc& desc);

// Calls visit(pixel) for pixels that stand for all, borders and corners among them.
template <class Visit>
void for_each_pixel(uint32_t width, uint32_t height, const Visit& visit) {
    constexpr int kSteps = 16;
    for (int row = 0; row <= kSteps; ++row)
        for (int column = 0; column <= kSteps; ++column)
            visit(Eigen::Vector2d((width - 1.0) * column / kSteps, (height - 1.0) * row / kSteps));
}

}  // namespace defrec
