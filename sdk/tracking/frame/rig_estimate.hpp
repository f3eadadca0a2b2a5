// How the right view lies against the left in time and space, as measured from the images.
#pragma once
#include <cstdint>

namespace defrec {

struct RigEstimate {
    float lag_frames = 0;          // of the right view, in this frame; 0: not measurable
    float vertical_offset_px = 0;  // of the right view at the image centre, down is positive
    float roll_deg = 0;            // of the right view about the image centre, clockwise
    float focal_ratio = 1;         // right to left
    float vergence = 0;         // of the right view to the left, rad; moves its image to the right
    float vergence_sigma = 0;   // its standard deviation; 0: not measured
    float corrected_sigma = 0;  // rad, what a correction of the vergence leaves
    float unseen_lag_frames = 0;  // standard deviation of a lag that would not be seen
    float lag_px = 0;  // of disparity, by which a lag that lasts spoils the middle of the image
    float last_depth_px = 0;     // of disparity, by which it was wrong when depth was last used
    float shared_noise_px2 = 0;  // covariance of the rows of matches that lie side by side
    uint32_t matches = 0;        // between left and right, behind the last four; 0: not measured
};

}  // namespace defrec
