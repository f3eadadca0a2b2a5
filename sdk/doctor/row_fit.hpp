// How the rows of the two rectified views differ, over the image and from frame to frame.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "sdk/doctor/rig_trial.hpp"

namespace defrec::cli {

// Step of the rows at the middle, px, and its growth along x and y: offset, roll, and what the
// focal lengths differ by.
struct RowFit {
    double step = 0, along_x = 0, along_y = 0;

    double at(const RectifiedMatch& match) const {
        return step + along_x * match.x + along_y * match.y;
    }
};
RowFit fit_rows(const std::vector<RectifiedMatch>& matches);

// For each pair of images with some matches, the median by which rows differ from the fit, px.
std::map<int, double> misfits_of_pairs(const std::vector<RectifiedMatch>& matches,
                                       const RowFit& fit);

// The least and the largest step of these pairs, each the median of its matches, px; 0 and 0 for
// none.
std::pair<double, double> range_of_steps(const std::vector<RectifiedMatch>& matches);

}  // namespace defrec::cli
