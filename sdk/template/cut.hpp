// Tissue that came apart: what connected the two sides of a line is released.
#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

using ViewPixel = std::array<double, 2>;  // u and v in the image of the first view

// Whether a cut of the piece crosses the straight line between two pixels.
bool is_parted(std::span<const CutLine> cuts, size_t piece, const ViewPixel& from,
               const ViewPixel& to);

// 1 for each vertex of the first view that is closer to a cut than a spacing of control points.
std::vector<uint8_t> vertices_beside_cuts(const TemplateData& data);

// A vertex near a cut: the one nearest to it across the cut, and as far behind it on its own side;
// itself, where another cut lies between.
struct VertexBesideCut {
    size_t vertex, across, behind;
    size_t cell;      // of the grid
    double distance;  // px, to the cut
};
// The vertices of the first view that are closer to a cut than so many spacings of control points
// and have both; for each such cut.
std::vector<VertexBesideCut> neighbours_across_cuts(const TemplateData& data, double spacings);

// Distance (px) from a pixel to the nearest cut of the piece; infinite where there is none.
double distance_to_cut(std::span<const CutLine> cuts, size_t piece, const ViewPixel& from);

// The template with one cut more. Indices keep their meaning, but those of connections: the ones
// that crossed the line are gone. Triangles that crossed it have three equal corners, and what is
// moved by control points on both sides is moved by those on its own. Tissue that joined later
// keeps its weights and triangles.
TemplateData release_across(TemplateData data, const CutLine& line);

// The cuts' points that lie on the surface, at rest.
std::vector<defrec_cut_point> cut_points(const TemplateData& data);

}  // namespace defrec
