// The metrics of SurgT: boxes that are followed in both views of a rectified video, from several
// frames on (anchors), and how long they overlap with the true ones.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace defrec::cli {

// px; (u, v) is the corner at the top left.
struct Box {
    double u = 0, v = 0, width = 0, height = 0;
};
using BoxPair = std::array<Box, 2>;  // left, right

struct TrueBoxes {
    bool visible_in_both = false, is_difficult = false;
    std::optional<BoxPair> boxes;
    bool counts() const { return visible_in_both && !is_difficult; }
};

// Intersection over union, 0 to 1.
double overlap_of(const Box& a, const Box& b);

// The tool truncates the centre of a box to whole pixels.
cv::Point box_centre(const Box& box);

// What one frame after the anchor adds to the scores.
struct BoxFrame {
    // So many times `overlap_in_curve` stands in the sub-sequence of the anchor; NaN: ignored
    // there.
    int times_in_curve = 0;
    double overlap_in_curve = std::numeric_limits<double>::quiet_NaN();
    bool is_counted = false;                    // in the denominator of robustness
    bool is_hit_2d = false, is_hit_3d = false;  // and in its numerators
    // NaN: none, or taken back because the tracker failed there.
    double overlap = std::numeric_limits<double>::quiet_NaN();
    double error_px = std::numeric_limits<double>::quiet_NaN();
    double error_mm = std::numeric_limits<double>::quiet_NaN();
};

// truth: of each frame of the video. The tracker was given the true boxes of frame `first`;
// predicted[i], for frame first + 1 + i, is empty where it gave none. q: disparity to depth, of
// cv::stereoRectify, mm.
//
// Means over both views. A frame misses in 2D where a view's overlap is at most 0.1, in 3D where
// the error is over 100 mm or a disparity is not positive. At the 11th miss in a row the tracker
// has failed: these 11 values are taken back, nothing is measured from then on, and the
// sub-sequence, which ends at the last frame that counts, goes on with zeros. As in the tool, a
// frame gives two zeros while the tracker has failed in 2D and not in 3D.
std::vector<BoxFrame> assess_boxes(const std::vector<TrueBoxes>& truth, std::size_t first,
                                   const std::vector<std::optional<BoxPair>>& predicted,
                                   const cv::Matx44d& q);

// Overlaps by frames after the anchor; empty: ignored.
using OverlapCurve = std::vector<std::optional<double>>;
// As long as the longest; each value over the curves that have one there.
OverlapCurve mean_curve(const std::vector<OverlapCurve>& curves);
// Expected average overlap: mean of the curve in [first, last). NaN where it has no value there; 0
// for no curve, as in the tool.
double expected_average_overlap(const OverlapCurve& curve, std::size_t first, std::size_t last);

}  // namespace defrec::cli
