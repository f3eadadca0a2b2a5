#include "sdk/template/capture.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sdk/template/check_patches.hpp"
#include "sdk/template/surface.hpp"
#include "sdk/template/surface_point.hpp"
#include "sdk/template/texture.hpp"

namespace defrec {
namespace {

// Control points on a grid that spans the image; one exists where the surface is within half a
// spacing.
void place_nodes(TemplateData& data, double spacing_px) {
    NodeGrid& grid = data.node_grid;
    grid.columns = std::max(2, static_cast<int>(std::lround((data.width - 1) / spacing_px)) + 1);
    grid.rows = std::max(2, static_cast<int>(std::lround((data.height - 1) / spacing_px)) + 1);
    grid.spacing_u = (data.width - 1.0) / (grid.columns - 1);
    grid.spacing_v = (data.height - 1.0) / (grid.rows - 1);
    grid.node.assign(static_cast<size_t>(grid.columns) * static_cast<size_t>(grid.rows), -1);
    for (int y = 0; y < grid.rows; ++y)
        for (int x = 0; x < grid.columns; ++x) {
            const double u = x * grid.spacing_u, v = y * grid.spacing_v;
            double disparity = 0, support = 0;
            if (!grid_disparity(data, u, v, disparity, support)) continue;
            grid.node[static_cast<size_t>(y * grid.columns + x)] =
                static_cast<int32_t>(data.nodes.size() / 3);
            for (const double value : back_project(data.camera, u, v, disparity))
                data.nodes.push_back(static_cast<float>(value));
        }
}

double distance(const std::vector<float>& nodes, size_t a, size_t b) {
    double squared = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
        const double difference = nodes[3 * a + axis] - nodes[3 * b + axis];
        squared += difference * difference;
    }
    return std::sqrt(squared);
}

double median(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Connections to everything within 2.5 spacings: dense, as the paper asks, so that smoothness
// travels far in one iteration.
void connect_nodes(TemplateData& data) {
    const size_t count = data.nodes.size() / 3;
    const NodeGrid& grid = data.node_grid;
    std::vector<double> steps;
    for (int y = 0; y < grid.rows; ++y)
        for (int x = 0; x + 1 < grid.columns; ++x) {
            const int32_t a = grid.node[static_cast<size_t>(y * grid.columns + x)];
            const int32_t b = grid.node[static_cast<size_t>(y * grid.columns + x + 1)];
            if (a >= 0 && b >= 0)
                steps.push_back(
                    distance(data.nodes, static_cast<size_t>(a), static_cast<size_t>(b)));
        }
    data.node_spacing_mm = median(std::move(steps));
    const double spacing = data.node_spacing_mm;
    for (size_t a = 0; a < count; ++a)
        for (size_t b = a + 1; b < count; ++b) {
            const double d = distance(data.nodes, a, b) / spacing;
            if (d > 2.5) continue;
            data.edges.push_back({static_cast<int32_t>(a), static_cast<int32_t>(b),
                                  static_cast<float>(std::exp(-0.5 * (d / 1.5) * (d / 1.5)))});
        }
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
            if (!surface_point(data, u, v, point)) continue;
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

double trackability(const CaptureInput& input, int cx, int cy) {
    constexpr int kRadius = 4;
    const auto gray = [&](int x, int y) {
        return int{input.gray[static_cast<size_t>(y) * input.width + static_cast<size_t>(x)]};
    };
    return texture(gray, cx, cy, kRadius);
}

bool masked_near(const CaptureInput& input, int cx, int cy, int radius) {
    for (int y = cy - radius; y <= cy + radius; y += 2)
        for (int x = cx - radius; x <= cx + radius; x += 2)
            if (input.mask != nullptr &&
                input.mask[static_cast<size_t>(y) * input.width + static_cast<size_t>(x)] == 0)
                return true;
    return false;
}

// The best trackable pixel of each cell of a grid over the image.
void place_patches(TemplateData& data, const CaptureInput& input) {
    constexpr int kBorder = 8;
    constexpr double kMinTrackability = 0.15;
    const double cell = std::max(
        12.0, std::sqrt(static_cast<double>(input.width) * input.height / input.max_patches));
    const int columns = static_cast<int>(input.width / cell),
              rows = static_cast<int>(input.height / cell);
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const int x0 = std::max(kBorder, static_cast<int>(column * cell)),
                      x1 = std::min(static_cast<int>(input.width) - kBorder,
                                    static_cast<int>((column + 1) * cell));
            const int y0 = std::max(kBorder, static_cast<int>(row * cell)),
                      y1 = std::min(static_cast<int>(input.height) - kBorder,
                                    static_cast<int>((row + 1) * cell));
            double best = kMinTrackability;
            int u = -1, v = -1;
            for (int y = y0; y < y1; y += 2)
                for (int x = x0; x < x1; x += 2) {
                    const double score = trackability(input, x, y);
                    if (score <= best || masked_near(input, x, y, 5)) continue;
                    double disparity = 0, support = 0;
                    if (!grid_disparity(data, x, y, disparity, support) ||
                        support > data.grid.spacing)
                        continue;
                    best = score;
                    u = x;
                    v = y;
                }
            if (u < 0) continue;
            defrec_patch patch{};
            if (surface_patch(data, u, v, patch)) data.patches.push_back(patch);
        }
}

}  // namespace

std::optional<TemplateData> capture_template(const CaptureInput& input) {
    TemplateData data;
    data.width = input.width;
    data.height = input.height;
    data.camera = input.camera;
    if (!fit_surface(input, data.grid)) return std::nullopt;
    place_nodes(data, input.node_spacing_px);
    if (data.nodes.size() < 3 * 4) return std::nullopt;
    connect_nodes(data);
    place_vertices(data);
    place_landmarks(data, input);
    place_patches(data, input);
    if (data.vertices.size() < 16 || data.triangles.empty()) return std::nullopt;
    data.image.assign(input.gray, input.gray + static_cast<size_t>(input.width) * input.height);
    place_checks(data);
    return data;
}

}  // namespace defrec
