// Draws a plan on the left image: parts by their outlines, with a halo of the expected error, and
// targets.
#pragma once

#include "sdk/report/drawing.hpp"
#include "sdk/report/record.hpp"

namespace cv {
class Mat;
}

namespace defrec::cli {

/// image: CV_8UC3, BGR. An outline is broken, and gray, where the part goes on but is unknown;
/// what is unknown is not drawn. Targets are crosses, as overlay.hpp draws others. The names of
/// parts and targets are added to the labels.
void draw_plan(cv::Mat& image, const PlanEstimate& plan, const Projector& projector,
               Labels& labels);

}  // namespace defrec::cli
