// Points of the template's surface under its pixels, with what moves them.
#pragma once
#include "sdk/template/template.hpp"

namespace defrec {

// The surface point at a pixel; false outside the surface or without control points.
bool surface_point(const TemplateData& data, double u, double v, defrec_surface_point& point);

// The piece of the template's image round a pixel, as stage align takes it; false likewise.
bool surface_patch(const TemplateData& data, double u, double v, defrec_patch& patch);

}  // namespace defrec
