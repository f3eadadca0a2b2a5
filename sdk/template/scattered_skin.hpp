// What moves a point between control points that lie anywhere in an image.
#pragma once
#include "sdk/template/pixel_buckets.hpp"
#include "sdk/template/template.hpp"

namespace defrec {

// The corners of the Delaunay triangle round a pixel, with barycentric weights, which reproduce
// positions as the bilinear ones of a grid do; beyond the control points, the nearest two with the
// weights of the nearest pixel between them. nodes: their index is that of the control point.
// spacing: usual distance between neighbours, px. False with less than two of them within 3
// spacings.
bool scattered_skin(const PixelBuckets& nodes, double spacing, double u, double v, Skin& skin);

}  // namespace defrec
