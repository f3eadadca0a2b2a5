// See sliding_sides.hpp.
#include "sdk/tracking/evidence/sliding_sides.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdk/template/cut.hpp"
#include "sdk/template/grid_lookup.hpp"
#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {
namespace {

using decisions::Confidence;

template <class Point>
Eigen::Vector3f place_of(const Point& point) {
    return Eigen::Map<const Eigen::Vector3f>(point.position);
}

// The vertex beside one of the grid's cells in its piece, on its side of all cuts; -1: there is
// none.
int32_t vertex_beside(const TemplateData& data, int x, int y, int right, int down) {
    const SurfaceGrid& grid = data.grid;
    const int other_x = x + right, other_y = y + down;
    const uint8_t piece = piece_at(grid, static_cast<size_t>(y * grid.columns + x));
    return is_parted(data.node_grid.cuts, piece, {x * grid.spacing, y * grid.spacing},
                     {other_x * grid.spacing, other_y * grid.spacing})
               ? -1
               : vertex_at(grid, other_x, other_y, piece);
}

}  // namespace

SurfaceShear::SurfaceShear(const TemplateData& data) : corners_(data.vertices.size()) {
    const SurfaceGrid& grid = data.grid;
    for (int y = 0; y < grid.rows; ++y)
        for (int x = 0; x < grid.columns; ++x) {
            const int32_t vertex = grid.vertex[static_cast<size_t>(y * grid.columns + x)];
            if (vertex < 0) continue;
            int32_t in_row = vertex_beside(data, x, y, 1, 0),
                    in_column = vertex_beside(data, x, y, 0, 1);
            if (in_row < 0) in_row = vertex_beside(data, x, y, -1, 0);
            if (in_column < 0) in_column = vertex_beside(data, x, y, 0, -1);
            if (in_row < 0 || in_column < 0) continue;
            const auto at = [&](int32_t i) {
                return place_of(data.vertices[static_cast<size_t>(i)]);
            };
            const Eigen::Vector3f row = at(in_row) - at(vertex),
                                  column = at(in_column) - at(vertex);
            corners_[static_cast<size_t>(vertex)] = {static_cast<uint32_t>(in_row),
                                                     static_cast<uint32_t>(in_column),
                                                     row.squaredNorm(),
                                                     column.squaredNorm(),
                                                     row.dot(column),
                                                     row.cross(column).squaredNorm()};
        }
}

// The squared stretches are the eigenvalues of the first fundamental form now in units of that at
// rest: their sum and their product are its trace and determinant.
bool SurfaceShear::is_sheared(size_t vertex, std::span<const defrec_surface_sample> samples) const {
    const Corner& corner = corners_[vertex];
    if (!(corner.area2 > 0)) return false;
    const Eigen::Vector3f at = place_of(samples[vertex]),
                          row = place_of(samples[corner.in_row]) - at,
                          column = place_of(samples[corner.in_column]) - at;
    const float sum = (corner.column2 * row.squaredNorm() + corner.row2 * column.squaredNorm() -
                       2 * corner.product * row.dot(column)) /
                      corner.area2,
                product = row.cross(column).squaredNorm() / corner.area2;
    constexpr float kMost = Confidence::kMaxShear * Confidence::kMaxShear;
    return sum * sum > (kMost + 1) * (kMost + 1) / kMost * product;
}

CutSides::CutSides(const TemplateData& data) {
    const double sigma = double{Confidence::kLineSigma} * data.node_grid.spacing_u;
    for (const VertexBesideCut& at : neighbours_across_cuts(data)) {
        const double is_beyond = std::erfc(at.distance / sigma / std::numbers::sqrt2) / 2;
        beside_.push_back(
            {at.vertex, at.across, at.behind, static_cast<float>(std::sqrt(is_beyond))});
    }
}

// What lies across may have moved otherwise than the vertex because its own side turned or
// stretched: less what lies behind did.
void CutSides::expect(const TemplateData& data, std::span<const defrec_surface_sample> samples,
                      std::span<float> error_mm) const {
    std::fill(error_mm.begin(), error_mm.end(), 0.0f);
    const auto moved = [&](size_t i) -> Eigen::Vector3f {
        return place_of(samples[i]) - place_of(data.vertices[i]);
    };
    for (const Beside& at : beside_)
        error_mm[at.vertex] =
            at.share * (moved(at.across) - 2 * moved(at.vertex) + moved(at.behind)).norm();
}

}  // namespace defrec
