// Connections between control points.
#pragma once
#include "sdk/template/template.hpp"

namespace defrec {

// mm between control points; nodes: xyz.
double node_distance(const std::vector<float>& nodes, size_t a, size_t b);

// Connects the control points from first on with all others of their piece within 2.5 spacings:
// dense, as the paper asks, so that smoothness travels far in one iteration. Needs node_spacing_mm.
void connect_nodes(TemplateData& data, size_t first);

}  // namespace defrec
