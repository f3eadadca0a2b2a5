// See band.hpp.
#include "sdk/tracking/monitors/band.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "sdk/template/cut.hpp"
#include "sdk/template/grid_lookup.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"

namespace defrec {

using decisions::Cuts;

std::vector<Band> in_squares(Band band, double side) {
    std::vector<Band> squares;
    if (static_cast<double>(band.cells.size()) <= side * side) {
        squares.push_back(std::move(band));
        return squares;
    }
    std::map<std::pair<int, int>, size_t> of_square;
    for (const Cell& cell : band.cells) {
        const auto [at, is_new] = of_square.try_emplace(
            {static_cast<int>(cell.x() / side), static_cast<int>(cell.y() / side)}, squares.size());
        if (is_new) squares.push_back({band.piece, {}});
        squares[at->second].cells.push_back(cell);
    }
    return squares;
}

Cell centre_of(const Band& band) {
    Cell sum = Cell::Zero();
    for (const Cell& cell : band.cells) sum += cell;
    return sum / static_cast<double>(band.cells.size());
}

std::vector<uint8_t> open_cells(const TemplateData& data, const std::vector<uint8_t>& frames,
                                uint8_t counts_from, double beside) {
    const SurfaceGrid& grid = data.grid;
    std::vector<uint8_t> open(frames.size(), 0);
    for (size_t i = 0; i < frames.size(); ++i) {
        if (frames[i] != counts_from) continue;
        const size_t columns = static_cast<size_t>(grid.columns), column = i % columns,
                     row = i / columns;
        const ViewPixel at{static_cast<double>(column) * grid.spacing,
                           static_cast<double>(row) * grid.spacing};
        open[i] = distance_to_cut(data.node_grid.cuts, piece_at(grid, i), at) >
                  beside * data.node_grid.spacing_u;
    }
    return open;
}

Band take_band(const SurfaceGrid& grid, std::vector<uint8_t>& open, size_t from) {
    Band band{piece_at(grid, from), {}};
    std::vector<size_t> next{from};
    open[from] = 0;
    while (!next.empty()) {
        const auto x = static_cast<int>(next.back() % static_cast<size_t>(grid.columns)),
                   y = static_cast<int>(next.back() / static_cast<size_t>(grid.columns));
        next.pop_back();
        band.cells.emplace_back(x, y);
        for (int row = std::max(0, y - 1); row <= std::min(grid.rows - 1, y + 1); ++row)
            for (int column = std::max(0, x - 1); column <= std::min(grid.columns - 1, x + 1);
                 ++column) {
                const auto cell = static_cast<size_t>(row * grid.columns + column);
                if (open[cell] == 0 || piece_at(grid, cell) != band.piece) continue;
                open[cell] = 0;
                next.push_back(cell);
            }
    }
    return band;
}

BandAxis axis_of(const Band& band) {
    const Cell centre = centre_of(band);
    Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
    for (const Cell& cell : band.cells) moments += (cell - centre) * (cell - centre).transpose();
    return axis_along(
        band, Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(moments).eigenvectors().col(1));
}

BandAxis axis_along(const Band& band, const Cell& along) {
    BandAxis axis{centre_of(band), along, {-along.y(), along.x()}, 0, 0};
    for (const Cell& cell : band.cells) {
        const double at = axis.along.dot(cell - axis.centre);
        axis.begin = std::min(axis.begin, at);
        axis.end = std::max(axis.end, at);
    }
    return axis;
}

bool is_line(const Band& band, const BandAxis& axis, double node_spacing) {
    return axis.length() >= Cuts::kMinLength * node_spacing &&
           axis.length() * axis.length() >=
               Cuts::kMinSlimness * static_cast<double>(band.cells.size());
}

std::vector<Cell> middle_line(const Band& band, const BandAxis& axis) {
    const auto slices = static_cast<size_t>(std::lround(axis.end - axis.begin)) + 1;
    std::vector<double> sum(slices, 0), count(slices, 0);
    for (const Cell& cell : band.cells) {
        const auto at =
            static_cast<int>(std::lround(axis.along.dot(cell - axis.centre) - axis.begin));
        for (int near = at - Cuts::kSmooth; near <= at + Cuts::kSmooth; ++near) {
            if (near < 0 || near >= static_cast<int>(slices)) continue;
            sum[static_cast<size_t>(near)] += axis.across.dot(cell - axis.centre);
            ++count[static_cast<size_t>(near)];
        }
    }
    std::vector<Cell> line;
    for (size_t i = 0; i < slices; ++i)
        if (count[i] > 0)
            line.push_back(axis.at(axis.begin + static_cast<double>(i), sum[i] / count[i]));
    return line;
}

std::array<Cell, 2> directions_at_ends(std::span<const Cell> line, size_t points) {
    const size_t beside = std::min(line.size() - 1, points);
    return {(line.front() - line[beside]).normalized(),
            (line.back() - line[line.size() - 1 - beside]).normalized()};
}

CutLine as_cut(std::vector<Cell> line, const Band& band, const SurfaceGrid& grid,
               const std::array<Cell, 2>& beyond) {
    const Cell first = line.front() + beyond[0], last = line.back() + beyond[1];
    line.insert(line.begin(), first);
    line.push_back(last);
    CutLine cut{band.piece, {}};
    const auto add = [&](const Cell& cell) {
        cut.pixels.push_back({static_cast<float>(cell.x() * grid.spacing),
                              static_cast<float>(cell.y() * grid.spacing)});
    };
    for (size_t i = 0; i + 1 < line.size(); i += 2) add(line[i]);
    add(line.back());
    return cut;
}

CutLine as_cut(std::vector<Cell> line, const Band& band, const SurfaceGrid& grid,
               double node_spacing, double beyond) {
    const auto [begin, end] = directions_at_ends(line, end_points(node_spacing));
    return as_cut(std::move(line), band, grid, {beyond * begin, beyond * end});
}

int32_t vertex_at(const SurfaceGrid& grid, const Cell& cell, uint8_t piece) {
    return vertex_at(grid, static_cast<int>(std::lround(cell.x())),
                     static_cast<int>(std::lround(cell.y())), piece);
}

}  // namespace defrec
