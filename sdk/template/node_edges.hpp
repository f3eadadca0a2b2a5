// Connections between control points.
#pragma once
#include "sdk/template/template.hpp"

namespace defrec {

// mm between control points; nodes: xyz.
double node_distance(const std::vector<float>& nodes, size_t a, size_t b);

// Connects two control points of a piece, at least one of which is first or later, where one is
// among the other's nearest eight and lies within 2.5 spacings. Needs node_spacing_mm.
void connect_nodes(TemplateData& data, size_t first);

}  // namespace defrec
