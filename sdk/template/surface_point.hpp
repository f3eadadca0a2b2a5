// Points of the template's surface under its pixels, with what moves them.
#pragma once
#include <Eigen/Core>

#include "sdk/template/template.hpp"

namespace defrec {

// Where the surface lies under a pixel, mm, and how it moves for one pixel to the right and one
// down.
struct SurfacePlace {
    Eigen::Vector3d position, normal, tangent_u, tangent_v;
};
// Needs the size, the camera and the grid alone; false outside the surface.
bool surface_place(const TemplateData& data, double u, double v, SurfacePlace& place);

// The surface point at a pixel; false outside the surface or without control points.
bool surface_point(const TemplateData& data, double u, double v, defrec_surface_point& point);

// The piece of the template's image round a pixel, as stage align takes it; false likewise.
bool surface_patch(const TemplateData& data, double u, double v, defrec_patch& patch);

}  // namespace defrec
