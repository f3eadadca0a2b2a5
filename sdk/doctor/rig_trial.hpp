// How well a calibration, or what it may have been meant to be, fits what both views show.
#pragma once

#include <span>
#include <vector>

#include "sdk/doctor/view_matches.hpp"
#include "sdk/io/calibration.hpp"

namespace defrec::cli {

// Mistakes by which a calibration that is right comes not to fit its images.
enum class Mistake {
    kNone,
    kPoseInverted,       // R and T lead from right to left
    kRotationTurned,     // R is transposed, T is right
    kTranslationTurned,  // T has the other sign
    kImagesExchanged,    // the left images are the right camera's
    kCamerasExchanged,   // M1, D1 are the right camera's
};

// A match in the rectified views.
struct RectifiedMatch {
    double x, y;       // of the left view, from the axis, px of the mean focal length
    double row_step;   // row in the right view less that in the left, px
    double disparity;  // px; towards 0 at infinity
    double depth_mm;   // below 0: behind the cameras
    int pair = 0;      // as of the ViewMatch
};

struct RigTrial {
    Mistake mistake = Mistake::kNone;
    std::vector<RectifiedMatch> matches;
    double row_error_px = 0;  // median of the rows' steps, without sign
    double front_share = 0;   // of the matches in front of the cameras
    double depth_mm = 0;      // median of those in front
};

// The calibration without the mistake.
StereoCalibration without(Mistake mistake, const StereoCalibration& calibration);

// Whether R is a rotation, T is not 0 and the focal lengths are positive.
bool has_pose(const StereoCalibration& calibration);

// The calibration has a pose.
RigTrial try_rig(const StereoCalibration& calibration, std::span<const ViewMatch> matches,
                 Mistake mistake);

}  // namespace defrec::cli
