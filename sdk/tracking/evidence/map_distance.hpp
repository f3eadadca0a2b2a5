// Distances along a template's surface, over the grid of its first view and those of the tissue
// that joined.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

// The first view's grid, and of the grids of the parts what lies round the tissue that they added.
class MapGrids {
  public:
    explicit MapGrids(const TemplateData& data);

    size_t cells() const { return cells_; }  // of all grids, numbered through
    size_t cell(size_t vertex) const { return cell_[vertex]; }
    struct Workspace {
        std::vector<uint8_t> is_spread;  // per grid
        std::vector<float> known;        // per cell, of one piece
    };
    // Memory for spread(), which then needs no more.
    void make_room(Workspace& workspace) const;
    // As spread_distance, over all grids: from one to the next where both have a vertex, and never
    // from one piece of the surface to another. distance: per cell.
    void spread(std::span<float> distance, Workspace& workspace) const;

  private:
    struct Source;  // a grid of the template
    struct Window;  // a rectangle of one
    // Where a grid shows a vertex of another.
    struct Joint {
        uint32_t cell, other_cell, other_grid;
    };
    struct Grid {
        size_t first_cell;
        int columns, rows;
        std::vector<Joint> joints;
    };

    void add_part(const Source& part);
    void add_cells(const Source& source, const Window& window);
    void add_joints(const Source& source, const Window& window, size_t grid);
    void spread_over_piece(std::span<float> distance, std::vector<uint8_t>& is_spread) const;

    size_t cells_ = 0;
    std::vector<uint32_t> cell_;  // per vertex: in the grid that it came with
    std::vector<uint32_t> grid_;  // per vertex: which that is
    std::vector<Grid> grids_;
    std::vector<std::vector<uint32_t>> cells_of_piece_;  // of its vertices; empty: there is one
};

}  // namespace defrec
