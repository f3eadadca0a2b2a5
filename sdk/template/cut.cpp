// See cut.hpp.
#include "sdk/template/cut.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "sdk/template/check_patches.hpp"
#include "sdk/template/grid_lookup.hpp"

namespace defrec {
namespace {

double side(const ViewPixel& a, const ViewPixel& b, const ViewPixel& of) {
    return (b[0] - a[0]) * (of[1] - a[1]) - (b[1] - a[1]) * (of[0] - a[0]);
}

// A pixel on the line counts as on one side of it, the same one for all.
bool crosses(const ViewPixel& a, const ViewPixel& b, const ViewPixel& from, const ViewPixel& to) {
    return (side(a, b, from) < 0) != (side(a, b, to) < 0) &&
           (side(from, to, a) < 0) != (side(from, to, b) < 0);
}

double distance_to_segment(const ViewPixel& a, const ViewPixel& b, const ViewPixel& from) {
    const double du = b[0] - a[0], dv = b[1] - a[1], squared = du * du + dv * dv;
    const double along =
        squared > 0
            ? std::clamp(((from[0] - a[0]) * du + (from[1] - a[1]) * dv) / squared, 0.0, 1.0)
            : 0;
    return std::hypot(a[0] + along * du - from[0], a[1] + along * dv - from[1]);
}

// Calls visit(one end, the other end) for each straight part of the piece's cuts until one returns
// true; whether one did.
template <class Visit>
bool any_segment(std::span<const CutLine> cuts, size_t piece, const Visit& visit) {
    for (const CutLine& cut : cuts) {
        if (cut.piece != piece) continue;
        for (size_t i = 0; i + 1 < cut.pixels.size(); ++i)
            if (visit(ViewPixel{cut.pixels[i][0], cut.pixels[i][1]},
                      ViewPixel{cut.pixels[i + 1][0], cut.pixels[i + 1][1]}))
                return true;
    }
    return false;
}

ViewPixel pixel_of(const defrec_camera& camera, const float xyz[3]) {
    return {camera.fx * double{xyz[0]} / double{xyz[2]} + camera.cx,
            camera.fy * double{xyz[1]} / double{xyz[2]} + camera.cy};
}

// Moved by control points on its own side, where others moved it.
template <class Item>
void part(const TemplateData& data, const ViewPixel& at, Item& item) {
    bool is_across = false;
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
        const float* node = &data.nodes[3 * static_cast<size_t>(item.node[k])];
        is_across |= item.weight[k] > 0 && is_parted(data.node_grid.cuts, data.piece_of(item), at,
                                                     pixel_of(data.camera, node));
    }
    BlendWeights blend_weights;
    if (!is_across ||
        !grid_blend_weights(data.node_grid, data.piece_of(item), at[0], at[1], blend_weights))
        return;
    std::copy(blend_weights.node.begin(), blend_weights.node.end(), item.node);
    std::copy(blend_weights.weight.begin(), blend_weights.weight.end(), item.weight);
}

// Control points of the first view's grid.
void release_connections(TemplateData& data) {
    const NodeGrid& grid = data.node_grid;
    std::vector<ViewPixel> at(data.nodes.size() / 3);
    std::vector<uint8_t> is_on_grid(at.size(), 0);
    for (size_t i = 0; i < grid.node.size(); ++i) {
        if (grid.node[i] < 0) continue;
        const auto node = static_cast<size_t>(grid.node[i]);
        const size_t columns = static_cast<size_t>(grid.columns), cell = i % grid.cells(),
                     column = cell % columns, row = cell / columns;
        at[node] = {static_cast<double>(column) * grid.spacing_u,
                    static_cast<double>(row) * grid.spacing_v};
        is_on_grid[node] = 1;
    }
    const auto is_released = [&](const defrec_edge& edge) {
        const auto a = static_cast<size_t>(edge.a), b = static_cast<size_t>(edge.b);
        return is_on_grid[a] != 0 && is_on_grid[b] != 0 &&
               is_parted(grid.cuts, data.piece_of_node(a), at[a], at[b]);
    };
    for (SurfacePatch& grown : data.parts)
        grown.before.edges -= static_cast<uint64_t>(std::count_if(
            data.edges.begin(),
            data.edges.begin() + static_cast<std::ptrdiff_t>(grown.before.edges), is_released));
    std::erase_if(data.edges, is_released);
}

// Across one cut, and no other, from one of a template's vertices.
class AcrossCut {
  public:
    AcrossCut(const TemplateData& data, size_t cut, double spacings)
        : data_(data), cut_(&data.node_grid.cuts[cut], 1), others_(data.node_grid.cuts) {
        others_.erase(others_.begin() + static_cast<std::ptrdiff_t>(cut));
        reach_ = spacings * data.node_grid.spacing_u;
        // Across a cut that is as far away lies a vertex a spacing farther.
        cells_ = static_cast<int>((reach_ + data.node_grid.spacing_u) / data.grid.spacing);
    }
    std::optional<VertexBesideCut> from(int x, int y) const {
        const SurfaceGrid& grid = data_.grid;
        const auto cell = static_cast<size_t>(y * grid.columns + x);
        if (grid.vertex[cell] < 0) return std::nullopt;
        const uint8_t piece = piece_at(grid, cell);
        const ViewPixel at = pixel(x, y);
        VertexBesideCut found{static_cast<size_t>(grid.vertex[cell]), 0, 0, cell,
                              distance_to_cut(cut_, piece, at)};
        if (found.distance >= reach_) return std::nullopt;
        int nearest = cells_ * cells_ + 1;
        for (int down = -cells_; down <= cells_; ++down)
            for (int right = -cells_; right <= cells_; ++right) {
                const int squared = down * down + right * right;
                if (squared >= nearest) continue;
                const int32_t across = vertex_at(grid, x + right, y + down, piece),
                              behind = vertex_at(grid, x - right, y - down, piece);
                const ViewPixel beyond = pixel(x + right, y + down),
                                back = pixel(x - right, y - down);
                if (across < 0 || behind < 0 || !is_parted(cut_, piece, at, beyond) ||
                    is_parted(others_, piece, at, beyond) || is_parted(cut_, piece, at, back))
                    continue;
                nearest = squared;
                found.across = static_cast<size_t>(across);
                found.behind = is_parted(others_, piece, at, back) ? found.vertex
                                                                   : static_cast<size_t>(behind);
            }
        if (nearest > cells_ * cells_) return std::nullopt;
        return found;
    }

  private:
    ViewPixel pixel(int x, int y) const { return {x * data_.grid.spacing, y * data_.grid.spacing}; }

    const TemplateData& data_;
    const std::span<const CutLine> cut_;
    std::vector<CutLine> others_;
    double reach_;  // px
    int cells_;
};

}  // namespace

bool is_parted(std::span<const CutLine> cuts, size_t piece, const ViewPixel& from,
               const ViewPixel& to) {
    return any_segment(cuts, piece, [&](const ViewPixel& a, const ViewPixel& b) {
        return crosses(a, b, from, to);
    });
}

double distance_to_cut(std::span<const CutLine> cuts, size_t piece, const ViewPixel& from) {
    double nearest = std::numeric_limits<double>::infinity();
    any_segment(cuts, piece, [&](const ViewPixel& a, const ViewPixel& b) {
        nearest = std::min(nearest, distance_to_segment(a, b, from));
        return false;
    });
    return nearest;
}

std::vector<uint8_t> vertices_beside_cuts(const TemplateData& data) {
    std::vector<uint8_t> is_beside(data.vertices.size(), 0);
    if (data.node_grid.cuts.empty()) return is_beside;
    for (size_t i = 0; i < data.first_counts().vertices; ++i) {
        const defrec_surface_point& vertex = data.vertices[i];
        is_beside[i] =
            distance_to_cut(data.node_grid.cuts, data.piece_of(vertex),
                            pixel_of(data.camera, vertex.position)) < data.node_grid.spacing_u;
    }
    return is_beside;
}

std::vector<VertexBesideCut> neighbours_across_cuts(const TemplateData& data, double spacings) {
    std::vector<VertexBesideCut> found;
    for (size_t cut = 0; cut < data.node_grid.cuts.size(); ++cut) {
        const AcrossCut across(data, cut, spacings);
        for (int y = 0; y < data.grid.rows; ++y)
            for (int x = 0; x < data.grid.columns; ++x)
                if (const std::optional<VertexBesideCut> beside = across.from(x, y))
                    found.push_back(*beside);
    }
    return found;
}

TemplateData release_across(TemplateData data, const CutLine& line) {
    data.node_grid.cuts.push_back(line);
    release_connections(data);
    const TemplateCounts first = data.first_counts();
    for (size_t i = 0; i < first.triangles; ++i) {
        uint32_t* corner = &data.triangles[3 * i];
        ViewPixel at[3];
        for (size_t k = 0; k < 3; ++k)
            at[k] = pixel_of(data.camera, data.vertices[corner[k]].position);
        const uint8_t piece = data.piece_of(data.vertices[corner[0]]);
        for (size_t k = 0; k < 3; ++k)
            if (is_parted(data.node_grid.cuts, piece, at[k], at[(k + 1) % 3]))
                corner[1] = corner[2] = corner[0];
    }
    for (size_t i = 0; i < first.vertices; ++i)
        part(data, pixel_of(data.camera, data.vertices[i].position), data.vertices[i]);
    for (size_t i = 0; i < first.landmarks; ++i)
        part(data, pixel_of(data.camera, data.landmark_points[i].position),
             data.landmark_points[i]);
    for (size_t i = 0; i < first.patches; ++i)
        part(data, {data.patches[i].u, data.patches[i].v}, data.patches[i]);
    for (size_t i = 0; i < first.checks; ++i)
        part(data, {data.checks[i].u, data.checks[i].v}, data.checks[i]);
    forget_checks_at_cuts(data);
    return data;
}

std::vector<defrec_cut_point> cut_points(const TemplateData& data) {
    std::vector<defrec_cut_point> points;
    for (size_t i = 0; i < data.node_grid.cuts.size(); ++i) {
        const CutLine& cut = data.node_grid.cuts[i];
        for (const auto& [u, v] : cut.pixels) {
            double disparity = 0, support = 0;
            if (!grid_disparity(data, cut.piece, double{u}, double{v}, disparity, support))
                continue;
            const auto [x, y, z] = back_project(data.camera, double{u}, double{v}, disparity);
            points.push_back({{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)},
                              static_cast<uint32_t>(i)});
        }
    }
    return points;
}

}  // namespace defrec
