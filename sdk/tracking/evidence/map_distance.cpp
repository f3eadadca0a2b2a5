// See map_distance.hpp.
#include "sdk/tracking/evidence/map_distance.hpp"

#include <algorithm>

#include "sdk/template/grid_distance.hpp"
#include "sdk/tracking/decisions/confidence.hpp"

namespace defrec {
namespace {

// Tissue that a part added is joined to the rest within this, or farther where nothing is so near.
constexpr int kReach = decisions::Confidence::kJoinedReach;

}  // namespace

struct MapGrids::Source {
    int columns, rows;
    std::span<const int32_t> vertex;  // per cell, -1: none
    size_t first_vertex;              // of those that came with it

    int32_t at(int x, int y) const {
        return vertex[static_cast<size_t>(y) * static_cast<size_t>(columns) +
                      static_cast<size_t>(x)];
    }
    bool is_own(int x, int y) const { return at(x, y) >= static_cast<int64_t>(first_vertex); }
    bool is_joint(int x, int y) const { return at(x, y) >= 0 && !is_own(x, y); }
};

// The rows of its grid lie along its longer side, over which distances spread faster.
struct MapGrids::Window {
    int left, top, right, bottom;          // the last two excluded
    std::vector<std::pair<int, int>> own;  // cells with vertices that came with it: x, y

    int columns() const { return right - left; }
    int rows() const { return bottom - top; }
    uint32_t index(int x, int y) const {
        x -= left;
        y -= top;
        return static_cast<uint32_t>(columns() < rows() ? x * rows() + y : y * columns() + x);
    }
    void widen(int by, const Source& source) {
        left = std::max(0, left - by);
        top = std::max(0, top - by);
        right = std::min(source.columns, right + by);
        bottom = std::min(source.rows, bottom + by);
    }
    template <class Visit>
    void for_each_cell(Visit&& visit) const {
        for (int y = top; y < bottom; ++y)
            for (int x = left; x < right; ++x) visit(x, y);
    }
};

MapGrids::MapGrids(const TemplateData& data)
    : cell_(data.vertices.size()), grid_(data.vertices.size()) {
    const Source first{data.grid.columns, data.grid.rows, data.grid.vertex, 0};
    Window whole{0, 0, first.columns, first.rows, {}};
    whole.for_each_cell([&](int x, int y) {
        if (first.is_own(x, y)) whole.own.emplace_back(x, y);
    });
    add_cells(first, whole);
    for (const SurfacePatch& part : data.parts)
        add_part({part.columns, part.rows, part.vertex, part.before.vertices});
    if (data.pieces() == 1) return;
    cells_of_piece_.resize(data.pieces());
    for (size_t i = 0; i < data.vertices.size(); ++i)
        cells_of_piece_[data.piece_of(data.vertices[i])].push_back(cell_[i]);
}

// A window for each stretch of its own vertices.
void MapGrids::add_part(const Source& part) {
    std::vector<Window> windows;
    std::vector<uint8_t> is_taken(part.vertex.size(), 0);
    const auto take = [&](int x, int y, Window& window) {
        uint8_t& taken = is_taken[static_cast<size_t>(y * part.columns + x)];
        if (taken == 0 && part.is_own(x, y)) window.own.emplace_back(x, y);
        taken = 1;
    };
    const Window whole{0, 0, part.columns, part.rows, {}};
    whole.for_each_cell([&](int x, int y) {
        Window window{x, y, x + 1, y + 1, {}};
        take(x, y, window);
        if (window.own.empty()) return;
        for (size_t next = 0; next < window.own.size(); ++next) {
            const auto [its_x, its_y] = window.own[next];
            Window near{its_x, its_y, its_x + 1, its_y + 1, {}};
            near.widen(kReach, part);
            near.for_each_cell([&](int other_x, int other_y) { take(other_x, other_y, window); });
            window.left = std::min(window.left, its_x);
            window.top = std::min(window.top, its_y);
            window.right = std::max(window.right, its_x + 1);
            window.bottom = std::max(window.bottom, its_y + 1);
        }
        bool has_joint = false;
        for (int by = kReach; !has_joint && by < 2 * std::max(part.columns, part.rows); by *= 2) {
            window.widen(by, part);
            window.for_each_cell(
                [&](int its_x, int its_y) { has_joint |= part.is_joint(its_x, its_y); });
        }
        windows.push_back(std::move(window));
    });
    const size_t first = grids_.size();
    for (const Window& window : windows) add_cells(part, window);
    for (size_t i = 0; i < windows.size(); ++i) add_joints(part, windows[i], first + i);
}

void MapGrids::add_cells(const Source& source, const Window& window) {
    for (const auto& [x, y] : window.own) {
        const auto vertex = static_cast<size_t>(source.at(x, y));
        cell_[vertex] = static_cast<uint32_t>(cells_) + window.index(x, y);
        grid_[vertex] = static_cast<uint32_t>(grids_.size());
    }
    grids_.push_back({cells_,
                      std::max(window.columns(), window.rows()),
                      std::min(window.columns(), window.rows()),
                      {}});
    cells_ += static_cast<size_t>(window.columns()) * static_cast<size_t>(window.rows());
}

void MapGrids::add_joints(const Source& source, const Window& window, size_t grid) {
    Grid& its = grids_[grid];
    window.for_each_cell([&](int x, int y) {
        if (source.at(x, y) < 0) return;
        const auto vertex = static_cast<size_t>(source.at(x, y));
        if (grid_[vertex] == grid) return;
        its.joints.push_back({static_cast<uint32_t>(its.first_cell) + window.index(x, y),
                              cell_[vertex], grid_[vertex]});
    });
}

void MapGrids::spread_over_piece(std::span<float> distance, std::vector<uint8_t>& is_spread) const {
    is_spread.assign(grids_.size(), 0);
    const auto visit = [&](size_t index) {
        const Grid& grid = grids_[index];
        for (const Joint& joint : grid.joints)
            if (distance[joint.other_cell] < distance[joint.cell]) {
                distance[joint.cell] = distance[joint.other_cell];
                is_spread[index] = 0;
            }
        if (is_spread[index] != 0) return;
        const auto cells = static_cast<size_t>(grid.columns) * static_cast<size_t>(grid.rows);
        spread_distance(distance.subspan(grid.first_cell, cells), grid.columns, grid.rows);
        is_spread[index] = 1;
        for (const Joint& joint : grid.joints)
            if (distance[joint.cell] < distance[joint.other_cell]) {
                distance[joint.other_cell] = distance[joint.cell];
                is_spread[joint.other_grid] = 0;
            }
    };
    for (size_t grid = 0; grid < grids_.size(); ++grid) visit(grid);
    // Back again: an earlier grid may be nearer to what a later one shows.
    for (size_t grid = grids_.size(); grid-- > 0;) visit(grid);
}

void MapGrids::make_room(Workspace& workspace) const {
    workspace.is_spread.reserve(grids_.size());
    if (!cells_of_piece_.empty()) workspace.known.reserve(cells_);
}

void MapGrids::spread(std::span<float> distance, Workspace& workspace) const {
    if (cells_of_piece_.empty()) {
        spread_over_piece(distance, workspace.is_spread);
        return;
    }
    // From a piece's vertices to its own alone.
    std::vector<float>& known = workspace.known;
    for (const std::vector<uint32_t>& own : cells_of_piece_) {
        known.assign(distance.size(), 1e6f);
        for (const uint32_t cell : own) known[cell] = distance[cell];
        spread_over_piece(known, workspace.is_spread);
        for (const uint32_t cell : own) distance[cell] = known[cell];
    }
}

}  // namespace defrec
