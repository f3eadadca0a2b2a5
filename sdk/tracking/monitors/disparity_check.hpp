// Whether the disparity that an application gave for a frame is that of its images: compared at
// the patches that were found in both of them.
#pragma once
#include <cstdint>

#include "sdk/template/template.hpp"
#include "sdk/tracking/frame/frame_output.hpp"
#include "sdk/tracking/frame/given_disparity.hpp"

namespace defrec {

struct DisparityCheck {
    bool disagrees = false;
    float error_px = 0;  // of the disparity, as the images tell; 0 where it agrees
    // It disagrees only as patches were not found in the right view, which smoke may hide as well.
    bool is_by_unfound = false;
};
// Whether so much is more than what is stated.
bool is_off(const KeptDisparity& kept, double px);
// output: of a frame that was followed with depth, with patches that were searched in the right
// view. Where too few patches are found in the left view nothing disagrees.
DisparityCheck check_disparity(const TemplateData& data, const FrameOutput& output,
                               const KeptDisparity& kept);

}  // namespace defrec
