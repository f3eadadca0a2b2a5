// Bands of cells of the template's grid along a line: gaps, and sides that slide along each other.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

using Cell = Eigen::Vector2d;  // column and row of the grid

struct Band {
    uint8_t piece = 0;
    std::vector<Cell> cells;
};

// A band's main direction, and its cells' extent along it.
struct BandAxis {
    Cell centre, along, across;
    double begin, end;
    // at: along it from the centre; beside: across.
    Cell at(double along_it, double beside) const {
        return centre + along_it * along + beside * across;
    }
    double length() const { return end - begin + 1; }
};

// Cells from one control point to the next.
inline double node_spacing(const TemplateData& data) {
    return data.node_grid.spacing_u / data.grid.spacing;
}

// 1 for each cell that counts and lies farther than `beside` spacings of control points from every
// line that was released: beside one some tissue counts to the wrong side. frames: per cell.
std::vector<uint8_t> open_cells(const TemplateData& data, const std::vector<uint8_t>& frames,
                                uint8_t counts_from, double beside);

// Counts a frame for each cell that is so, up to `most`, and takes one from the others. Returns how
// many cells have `most`.
template <class IsSo>
size_t count_frame(std::vector<uint8_t>& frames, uint8_t most, const IsSo& is_so) {
    size_t cells = 0;
    for (size_t i = 0; i < frames.size(); ++i) {
        if (is_so(i))
            frames[i] += frames[i] < most ? 1 : 0;
        else if (frames[i] > 0)
            --frames[i];
        cells += frames[i] == most ? 1 : 0;
    }
    return cells;
}

// The cells that are marked, 1 in open, and connected with `from` in its piece; they are unmarked.
Band take_band(const SurfaceGrid& grid, std::vector<uint8_t>& open, size_t from);

// A band that has more cells than a square of so many a side by the squares of the grid in which
// they lie. Those of one square need not be connected.
std::vector<Band> in_squares(Band band, double side);

Cell centre_of(const Band& band);
BandAxis axis_of(const Band& band);
// The same, in a direction that is known; of length 1.
BandAxis axis_along(const Band& band, const Cell& along);

// Whether it is long enough for a line, and slim. node_spacing: of control points, cells.
bool is_line(const Band& band, const BandAxis& axis, double node_spacing);

// Through the middle of the band, a step of the grid apart along its axis.
std::vector<Cell> middle_line(const Band& band, const BandAxis& axis);

// Points from an end of a line to where its direction at the end is taken from. node_spacing: as
// above.
inline size_t end_points(double node_spacing) { return static_cast<size_t>(node_spacing) + 1; }
// In which directions a line of at least two points goes on at its begin and at its end, of
// length 1: those of so many points, or of all if it has fewer.
std::array<Cell, 2> directions_at_ends(std::span<const Cell> line, size_t points);

// The line in the first view, longer at its begin and end by `beyond`.
CutLine as_cut(std::vector<Cell> line, const Band& band, const SurfaceGrid& grid,
               const std::array<Cell, 2>& beyond);
// The same, longer by so many cells as it goes on at either end.
CutLine as_cut(std::vector<Cell> line, const Band& band, const SurfaceGrid& grid,
               double node_spacing, double beyond);

// The vertex at a cell of the piece's surface; -1: there is none.
int32_t vertex_at(const SurfaceGrid& grid, const Cell& cell, uint8_t piece);

}  // namespace defrec
