// Distances on a grid.
#pragma once
#include <span>

namespace defrec {

// Lowers every value of a grid to the least of the others plus the distance there, in grid steps
// (chamfer: 1 to a side, sqrt 2 to a corner). With 0 at some places and much at all others: the
// distance to the nearest of these places. distance: rows of columns values each.
void spread_distance(std::span<float> distance, int columns, int rows);

}  // namespace defrec
