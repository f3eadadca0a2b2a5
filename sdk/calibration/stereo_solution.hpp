// The two cameras that fit the boards, and what speaks for and against them.
#pragma once

#include <string>
#include <vector>

#include "sdk/calibration/board_frames.hpp"

namespace defrec::cli {

struct ViewSolution {
    cv::Mat matrix, distortion;       // of OpenCV, px
    double residual_px = 0;           // root mean square, with what both views say
    double focal_error = 0;           // standard deviation of fx, as a share
    double coverage = 0;              // share of the cells that boards of the used frames reached
    std::vector<std::string> missed;  // corners and sides of the image that none reached
};

struct StereoSolution {
    ViewSolution left, right;
    cv::Mat rotation, translation;  // x_right = R x_left + T, mm
    std::vector<std::size_t> used;  // of the recording's frames
    std::vector<double> frame_px;   // of each used frame, both views, root mean square
    std::size_t left_out = 0;       // chosen frames that did not fit
    double max_tilt_degrees = 0;    // of a used board against the image plane
    // Rows of both views that should be the same, in all frames with the board but those left out.
    double rows_px = 0;       // root mean square
    double rows_bias_px = 0;  // the mean of the region where it is largest
    std::string rows_region;  // which that is
    double distance_mm = 0;   // where tissue is, given or the boards' median
    // Depths at that distance, if disparities are wrong by as much as rows: of one pixel, and what
    // stays over a region.
    double depth_error_mm = 0, depth_bias_mm = 0;
    // Corners found in space by both views against the board: root mean square after a rigid fit,
    // and the length of its diagonal as a share of the true one less 1.
    double shape_error_mm = 0, length_error = 0;

    double baseline_mm() const { return cv::norm(translation); }
};

// coefficients: of each lens, 0, 4, 5 or 8. distance_mm: 0: the boards' median. Throws
// CliError(kCalibration) with too few frames that fit.
StereoSolution solve_stereo(const BoardFinder& finder, const BoardRecording& recording,
                            const std::vector<std::size_t>& chosen, int coefficients,
                            double distance_mm);

}  // namespace defrec::cli
