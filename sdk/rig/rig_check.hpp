// What a calibration must fulfil before anything is computed from it (faults rows 1-9).
#pragma once
#include "include/defrec_c.h"

namespace defrec {

// desc: struct_size settled. Throws Error(DEFREC_ERROR_ARGUMENT), or DEFREC_ERROR_UNSUPPORTED for a
// baseline that is not horizontal, with an error message that names the field.
void check_rig(const defrec_rig_desc& desc);

// The largest distance from the principal point to a corner of the image, in units of the focal
// length.
double image_reach(const defrec_intrinsics& intrinsics, uint32_t width, uint32_t height);

}  // namespace defrec
