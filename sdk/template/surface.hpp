// The smooth surface under a disparity image: a thin-plate smoothing spline on a regular grid. Used
// when a template is captured.
#pragma once
#include "sdk/template/capture.hpp"

namespace defrec {

// Grid with disparity, support and vertex (0 where there is surface, -1 where not). False when too
// little disparity was measured.
bool fit_surface(const CaptureInput& input, SurfaceGrid& grid);

}  // namespace defrec
