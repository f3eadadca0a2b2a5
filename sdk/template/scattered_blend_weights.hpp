// Blend weights of a point between control points that lie anywhere in an image.
#pragma once
#include <span>

#include "sdk/template/pixel_buckets.hpp"
#include "sdk/template/template.hpp"

namespace defrec {

// The corners of the Delaunay triangle round a pixel, with barycentric weights, which reproduce
// positions as the bilinear ones of a grid do; beyond the control points, the nearest two with the
// weights of the nearest pixel between them. nodes: their index is that of the control point.
// spacing: usual distance between neighbours, px. False with less than two of them within 3
// spacings.
bool scattered_blend_weights(const PixelBuckets& nodes, double spacing, double u, double v,
                             BlendWeights& blend_weights);

// How such weights change along a patch's tangents: as those of the triangle of the control points
// at rest, in its plane. 0 beyond the control points. nodes: xyz of all.
defrec_patch_slope scattered_slope(std::span<const float> nodes, const defrec_patch& patch);

}  // namespace defrec
