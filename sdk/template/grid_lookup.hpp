// What lies at a cell of the first view's grid.
#pragma once
#include <cstddef>
#include <cstdint>

#include "sdk/template/template.hpp"

namespace defrec {

// Means something where the grid has a vertex.
inline uint8_t piece_at(const SurfaceGrid& grid, size_t cell) {
    return grid.piece.empty() ? uint8_t{0} : grid.piece[cell];
}

// The vertex of the piece there; -1: there is none, or the cell is not on the grid.
inline int32_t vertex_at(const SurfaceGrid& grid, int x, int y, uint8_t piece) {
    if (x < 0 || y < 0 || x >= grid.columns || y >= grid.rows) return -1;
    const auto cell = static_cast<size_t>(y * grid.columns + x);
    return piece_at(grid, cell) == piece ? grid.vertex[cell] : -1;
}

}  // namespace defrec
