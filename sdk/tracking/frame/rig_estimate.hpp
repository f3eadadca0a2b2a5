// How the right view lies against the left in time and space, as measured from the images.
#pragma once
#include <cstdint>

namespace defrec {

struct RigEstimate {
    float lag_frames = 0;          // of the right view, in this frame; 0: not measurable
    float vertical_offset_px = 0;  // of the right view at the image centre, down is positive
    float roll_deg = 0;            // of the right view about the image centre, clockwise
    float focal_ratio = 1;         // right to left
    // Shift of rows in the corners of the image, down and up in turn: distortion that the
    // calibration does not know shifts the rows of near things so. 0: none, or not measured.
    float distortion_px = 0;
    uint32_t matches = 0;  // between left and right, behind the last four; 0: not measured
};

}  // namespace defrec
