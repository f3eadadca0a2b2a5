// See sliding_sides.hpp.
#include "sdk/tracking/evidence/sliding_sides.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdk/template/cut.hpp"
#include "sdk/template/grid_lookup.hpp"
#include "sdk/tracking/decisions/confidence.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"

namespace defrec {
namespace {

using decisions::Confidence;

template <class Point>
Eigen::Vector3f place_of(const Point& point) {
    return Eigen::Map<const Eigen::Vector3f>(point.position);
}

// The vertex at an offset from one of the grid's cells in its piece, on its side of all cuts; -1:
// there is none.
int32_t vertex_beside(const TemplateData& data, int x, int y, int right, int down) {
    const SurfaceGrid& grid = data.grid;
    const int other_x = x + right, other_y = y + down;
    const uint8_t piece = piece_at(grid, static_cast<size_t>(y * grid.columns + x));
    return is_parted(data.node_grid.cuts, piece, {x * grid.spacing, y * grid.spacing},
                     {other_x * grid.spacing, other_y * grid.spacing})
               ? -1
               : vertex_at(grid, other_x, other_y, piece);
}

// Whether one stretch is more than so many times the other, by the sum and the product of their
// squares.
bool exceeds(float sum, float product, float ratio) {
    const float squared = ratio * ratio;
    return sum * sum > (squared + 1) * (squared + 1) / squared * product;
}

}  // namespace

SurfaceShear::SurfaceShear(const TemplateData& data)
    : corners_(data.vertices.size()),
      reach_(std::max(1, static_cast<int>(std::lround(double{Confidence::kShearReach} *
                                                      data.node_grid.spacing_u /
                                                      std::max(1.0, data.grid.spacing))))) {
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
                                                     row.cross(column).squaredNorm(),
                                                     x,
                                                     y};
        }
}

// The squared stretches are the eigenvalues of the first fundamental form now in units of that at
// rest: their sum and their product are its trace and determinant.
Shear SurfaceShear::at(size_t vertex, std::span<const defrec_surface_sample> samples) const {
    const Corner& corner = corners_[vertex];
    if (!(corner.area2 > 0)) return Shear::kNone;
    const Eigen::Vector3f at = place_of(samples[vertex]),
                          row = place_of(samples[corner.in_row]) - at,
                          column = place_of(samples[corner.in_column]) - at;
    const float sum = (corner.column2 * row.squaredNorm() + corner.row2 * column.squaredNorm() -
                       2 * corner.product * row.dot(column)) /
                      corner.area2,
                product = row.cross(column).squaredNorm() / corner.area2;
    if (!exceeds(sum, product, Confidence::kMayShear)) return Shear::kNone;
    return exceeds(sum, product, Confidence::kMaxShear) ? Shear::kCertain : Shear::kPossible;
}

void SurfaceShear::spread(const TemplateData& data, std::span<const Shear> sheared,
                          std::span<Shear> beside) const {
    const SurfaceGrid& grid = data.grid;
    std::fill(beside.begin(), beside.end(), Shear::kNone);
    for (size_t i = 0; i < sheared.size(); ++i) {
        if (sheared[i] == Shear::kNone) continue;
        const Corner& from = corners_[i];
        for (int y = std::max(0, from.y - reach_); y <= std::min(grid.rows - 1, from.y + reach_);
             ++y)
            for (int x = std::max(0, from.x - reach_);
                 x <= std::min(grid.columns - 1, from.x + reach_); ++x)
                if (const int32_t vertex = grid.vertex[static_cast<size_t>(y * grid.columns + x)];
                    vertex >= 0) {
                    Shear& most = beside[static_cast<size_t>(vertex)];
                    most = std::max(most, sheared[i]);
                }
    }
}

float SurfaceShear::error_between(const TemplateData& data, size_t vertex,
                                  std::span<const defrec_surface_sample> samples) const {
    const Corner& corner = corners_[vertex];
    const auto moved = [&](size_t i) -> Eigen::Vector3f {
        return place_of(samples[i]) - place_of(data.vertices[i]);
    };
    const int aslant = std::max(1, static_cast<int>(std::lround(reach_ / std::numbers::sqrt2)));
    const int directions[4][2] = {{reach_, 0}, {0, reach_}, {aslant, aslant}, {aslant, -aslant}};
    float most2 = 0;
    for (const auto& [right, down] : directions) {
        const int32_t ahead = vertex_beside(data, corner.x, corner.y, right, down),
                      behind = vertex_beside(data, corner.x, corner.y, -right, -down);
        if (ahead < 0 && behind < 0) continue;
        // One that is missing leaves half: by how much the vertex and the other differ.
        const Eigen::Vector3f own = moved(vertex),
                              one = ahead < 0 ? own : moved(static_cast<size_t>(ahead)),
                              other = behind < 0 ? own : moved(static_cast<size_t>(behind));
        const float share = ahead < 0 || behind < 0 ? 1.0f : 0.5f;
        most2 = std::max(most2, share * share * (one - other).squaredNorm());
    }
    return std::sqrt(most2);
}

CutSides::CutSides(const TemplateData& data) {
    const double sigma = double{Confidence::kLineSigma} * data.node_grid.spacing_u;
    for (const VertexBesideCut& at : neighbours_across_cuts(data, Confidence::kSideReach)) {
        const double is_beyond = at.distance < data.node_grid.spacing_u
                                     ? std::erfc(at.distance / sigma / std::numbers::sqrt2) / 2
                                     : 0;
        beside_.push_back(
            {at.vertex, at.across, at.behind, at.cell, static_cast<float>(std::sqrt(is_beyond))});
    }
}

// What lies across may have moved otherwise than the vertex because its own side turned or
// stretched: less what lies behind did.
void CutSides::expect(const TemplateData& data, std::span<const defrec_surface_sample> samples,
                      std::span<const uint8_t> unconfirmed, std::span<float> error_mm) const {
    std::fill(error_mm.begin(), error_mm.end(), 0.0f);
    const auto moved = [&](size_t i) -> Eigen::Vector3f {
        return place_of(samples[i]) - place_of(data.vertices[i]);
    };
    static_assert(Confidence::kSideDoubted <= decisions::Slips::kFrames);
    for (const Beside& at : beside_) {
        const bool is_doubted =
            at.cell < unconfirmed.size() && unconfirmed[at.cell] >= Confidence::kSideDoubted;
        const float share = is_doubted ? 1 : at.share;
        if (share == 0) continue;
        error_mm[at.vertex] =
            std::max(error_mm[at.vertex],
                     share * (moved(at.across) - 2 * moved(at.vertex) + moved(at.behind)).norm());
    }
}

}  // namespace defrec
