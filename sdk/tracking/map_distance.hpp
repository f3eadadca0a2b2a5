// Distances along a template's surface, over the grid of its first view and those of the tissue
// that joined.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

// The cell of each vertex: of the first view's grid, then of the parts' grids one after the other.
// Returns how many cells there are. cell: per vertex.
size_t number_cells(const TemplateData& data, std::vector<uint32_t>& cell);

// As spread_distance, over all grids: from one to the next where a part's grid has a vertex of an
// earlier one, and never from one piece of the surface to another. distance: per cell.
void spread_over_map(const TemplateData& data, std::span<const uint32_t> cell,
                     std::span<float> distance);

}  // namespace defrec
