// Everything that the doctor looks at, a file for each.
#pragma once

#include "sdk/doctor/evidence.hpp"
#include "sdk/doctor/finding.hpp"

namespace defrec::cli {

// What to do about a source whose right view comes first.
inline constexpr char kHalvesExchanged[] =
    "Of one source with both views no --layout has the right view first: cut its images into two, "
    "with FFmpeg by -vf crop=iw/2:ih:iw/2:0 for the left view and crop=iw/2:ih:0:0 for the right "
    "one where they stand side by side, and give both as --left and --right.";

// The images alone.
Finding look_at_exposure(const Evidence& evidence);
Finding look_at_black_frames(const Evidence& evidence);
Finding look_at_white_frames(const Evidence& evidence);
Finding look_at_repeated_frames(const Evidence& evidence);
Finding look_at_bars(const Evidence& evidence);
Finding look_at_interlacing(const Evidence& evidence);
Finding look_at_compression(const Evidence& evidence);
Finding look_at_sharpness(const Evidence& evidence);
Finding look_at_one_view_twice(const Evidence& evidence);
Finding look_at_common_content(const Evidence& evidence);
Finding look_at_overlap(const Evidence& evidence);
// The calibration, and how the images fit it.
Finding look_at_resolution(const Evidence& evidence);
Finding look_at_order(const Evidence& evidence);
Finding look_at_pose(const Evidence& evidence);
Finding look_at_units(const Evidence& evidence);
Finding look_at_baseline(const Evidence& evidence);
Finding look_at_rows(const Evidence& evidence);
Finding look_at_calibration(const Evidence& evidence);
// The tracker's results.
Finding look_at_lag(const Evidence& evidence);
Finding look_at_disparity_range(const Evidence& evidence);
Finding look_at_followed(const Evidence& evidence);

// All of them, in the order in which they are to be mended. What follows from another finding is
// not found a second time.
std::vector<Finding> look_at_everything(const Evidence& evidence);

}  // namespace defrec::cli
