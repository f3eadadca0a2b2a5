// The smooth surface under a disparity image: a thin-plate smoothing spline on a regular grid. Used
// when a template is captured or grows.
#pragma once
#include <optional>

#include "sdk/template/capture.hpp"

namespace defrec {

// Grid with disparity, support, vertex (0 where there is surface, -1 where not) and piece. How many
// pieces the surface has; 0 when too little disparity was measured.
size_t fit_surface(const CaptureInput& input, SurfaceGrid& grid);

// Disparity, px, at a pixel: of a plane fitted to what was measured at most radius px away, without
// outliers; nothing where that is too little. Needs the size and the disparity alone.
std::optional<double> measured_disparity(const CaptureInput& input, double u, double v, int radius);

}  // namespace defrec
