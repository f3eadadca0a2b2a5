#include "sdk/template/capture.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sdk/base/util/median.hpp"
#include "sdk/template/check_patches.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/template/grid_lookup.hpp"
#include "sdk/template/node_edges.hpp"
#include "sdk/template/patch_places.hpp"
#include "sdk/template/surface.hpp"
#include "sdk/template/surface_point.hpp"

namespace defrec {
namespace {

// Takes the pieces' new numbers; -1: the piece is none.
void renumber_pieces(SurfaceGrid& grid, const std::vector<int>& numbers, size_t pieces) {
    for (size_t i = 0; i < grid.vertex.size(); ++i) {
        if (grid.vertex[i] < 0) continue;
        const int number = numbers[piece_at(grid, i)];
        if (number < 0)
            grid.vertex[i] = -1;
        else if (!grid.piece.empty())
            grid.piece[i] = static_cast<uint8_t>(number);
    }
    if (pieces < 2) grid.piece.clear();
}

// Control points on a grid that spans the image, for each piece of the surface; one exists where
// the piece is within half a spacing. A piece that lies between them has none and is left out:
// nothing would move it.
void place_nodes(TemplateData& data, size_t pieces, double spacing_px) {
    NodeGrid& grid = data.node_grid;
    grid.columns = std::max(2, static_cast<int>(std::lround((data.width - 1) / spacing_px)) + 1);
    grid.rows = std::max(2, static_cast<int>(std::lround((data.height - 1) / spacing_px)) + 1);
    grid.spacing_u = (data.width - 1.0) / (grid.columns - 1);
    grid.spacing_v = (data.height - 1.0) / (grid.rows - 1);
    std::vector<int> numbers(pieces, -1);
    size_t kept = 0;
    for (size_t piece = 0; piece < pieces; ++piece) {
        const size_t first = data.nodes.size();
        grid.node.resize(grid.cells() * (kept + 1), -1);
        size_t cell = grid.cells() * kept;
        for (int y = 0; y < grid.rows; ++y)
            for (int x = 0; x < grid.columns; ++x, ++cell) {
                const double u = x * grid.spacing_u, v = y * grid.spacing_v;
                double disparity = 0, support = 0;
                if (!grid_disparity(data, static_cast<int>(piece), u, v, disparity, support))
                    continue;
                grid.node[cell] = static_cast<int32_t>(data.nodes.size() / 3);
                for (const double value : back_project(data.camera, u, v, disparity))
                    data.nodes.push_back(static_cast<float>(value));
                data.node_piece.push_back(static_cast<uint8_t>(kept));
            }
        if (data.nodes.size() > first) numbers[piece] = static_cast<int>(kept++);
    }
    grid.node.resize(grid.cells() * kept);
    if (kept < 2) data.node_piece.clear();
    renumber_pieces(data.grid, numbers, kept);
}

void measure_node_spacing(TemplateData& data) {
    const NodeGrid& grid = data.node_grid;
    std::vector<double> steps;
    for (size_t first = 0; first < grid.node.size(); first += static_cast<size_t>(grid.columns))
        for (size_t i = first; i + 1 < first + static_cast<size_t>(grid.columns); ++i)
            if (const int32_t a = grid.node[i], b = grid.node[i + 1]; a >= 0 && b >= 0)
                steps.push_back(
                    node_distance(data.nodes, static_cast<size_t>(a), static_cast<size_t>(b)));
    data.node_spacing_mm = median(std::move(steps));
}

void place_vertices(TemplateData& data) {
    SurfaceGrid& grid = data.grid;
    // The grid is read while points are made of it, so it is rewritten only afterwards.
    std::vector<int32_t> index_of(grid.vertex.size(), -1);
    for (int y = 0; y < grid.rows; ++y)
        for (int x = 0; x < grid.columns; ++x) {
            const size_t index = static_cast<size_t>(y * grid.columns + x);
            if (grid.vertex[index] < 0) continue;
            const double u = std::min<double>(x * grid.spacing, data.width - 1);
            const double v = std::min<double>(y * grid.spacing, data.height - 1);
            defrec_surface_point point{};
            // On the image's rim the piece round a pixel may be another one than its vertex is of.
            if (!surface_point(data, u, v, point) ||
                (!grid.piece.empty() && data.piece_of(point) != grid.piece[index]))
                continue;
            index_of[index] = static_cast<int32_t>(data.vertices.size());
            data.vertices.push_back(point);
            data.vertex_support.push_back(grid.support[index]);
        }
    grid.vertex = std::move(index_of);
    for (int y = 0; y + 1 < grid.rows; ++y)
        for (int x = 0; x + 1 < grid.columns; ++x) {
            const auto vertex = [&](int dx, int dy) {
                return grid.vertex[static_cast<size_t>((y + dy) * grid.columns + x + dx)];
            };
            const int32_t a = vertex(0, 0), b = vertex(1, 0), c = vertex(0, 1), d = vertex(1, 1);
            const auto add = [&](int32_t i, int32_t j, int32_t k) {
                if (i < 0 || j < 0 || k < 0) return;
                const auto piece = [&](int32_t of) {
                    return data.piece_of(data.vertices[static_cast<size_t>(of)]);
                };
                if (piece(i) != piece(j) || piece(j) != piece(k)) return;
                for (const int32_t index : {i, j, k})
                    data.triangles.push_back(static_cast<uint32_t>(index));
            };
            add(a, c, b);
            add(b, c, d);
        }
}

void place_landmarks(TemplateData& data, const CaptureInput& input) {
    for (const defrec_feature& feature : input.features) {
        const double u = feature.x / 16.0, v = feature.y / 16.0;
        double disparity = 0, support = 0;
        if (!grid_disparity(data, u, v, disparity, support) || support > data.grid.spacing)
            continue;
        defrec_surface_point point{};
        if (!surface_point(data, u, v, point)) continue;
        defrec_landmark landmark{};
        std::copy(std::begin(feature.descriptor), std::end(feature.descriptor),
                  landmark.descriptor);
        std::copy(std::begin(point.position), std::end(point.position), landmark.position);
        data.landmarks.push_back(landmark);
        data.landmark_points.push_back(point);
    }
}

void place_patches(TemplateData& data, const CaptureInput& input) {
    const auto has_surface = [&](int u, int v) {
        double disparity = 0, support = 0;
        return grid_disparity(data, u, v, disparity, support) && support <= data.grid.spacing;
    };
    for (const PatchPlace place :
         trackable_places(input, patch_cell(input), decisions::PatchPlaces::kBorder, has_surface)) {
        defrec_patch patch{};
        if (surface_patch(data, place.u, place.v, patch)) data.patches.push_back(patch);
    }
}

}  // namespace

std::optional<TemplateData> capture_template(const CaptureInput& input) {
    TemplateData data;
    data.width = input.width;
    data.height = input.height;
    data.camera = input.camera;
    data.disparity_sigma_px = input.disparity_sigma_px;
    data.texture_level = input.texture_level;
    const size_t pieces = fit_surface(input, data.grid);
    if (pieces == 0) return std::nullopt;
    place_nodes(data, pieces, input.node_spacing_px);
    const size_t nodes = data.nodes.size() / 3;
    if (nodes < decisions::TemplateSize::kMinNodes) return std::nullopt;
    measure_node_spacing(data);
    connect_nodes(data, 0);
    place_vertices(data);
    place_landmarks(data, input);
    place_patches(data, input);
    if (data.vertices.size() < decisions::TemplateSize::kMinVertices || data.triangles.empty())
        return std::nullopt;
    data.image.assign(input.gray, input.gray + static_cast<size_t>(input.width) * input.height);
    place_checks(data);
    return data;
}

}  // namespace defrec
