#include "sdk/template/template.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sdk/body/body_slot.hpp"
#include "sdk/template/cut.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/template/grid_lookup.hpp"
#include "sdk/template/nearest_surface.hpp"
#include "sdk/template/surface_index.hpp"
#include "sdk/template/texture_level.hpp"

namespace defrec {

namespace {

struct PixelAt {
    double u, v;
    bool is_valid;  // before the camera
};
PixelAt pixel_of(const TemplateData& data, const double xyz[3]) {
    if (!(xyz[2] > 0 && std::isfinite(xyz[2]))) return {0, 0, false};
    const double u = data.camera.fx * xyz[0] / xyz[2] + data.camera.cx,
                 v = data.camera.fy * xyz[1] / xyz[2] + data.camera.cy;
    return {u, v, std::abs(u) < 1e6 && std::abs(v) < 1e6};
}

// The first view's vertex of a piece nearest to a point's pixel.
int32_t vertex_under(const TemplateData& data, int piece, const double xyz[3]) {
    const SurfaceGrid& grid = data.grid;
    const auto [u, v, is_valid] = pixel_of(data, xyz);
    if (!is_valid) return -1;
    const int column = static_cast<int>(std::lround(u / grid.spacing)),
              row = static_cast<int>(std::lround(v / grid.spacing));
    int32_t nearest = -1;
    int best = 9;
    for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
            const int x = column + dx, y = row + dy;
            if (x < 0 || y < 0 || x >= grid.columns || y >= grid.rows || dx * dx + dy * dy >= best)
                continue;
            const size_t cell = static_cast<size_t>(y * grid.columns + x);
            const int32_t vertex = grid.vertex[cell];
            if (vertex < 0 || piece_at(grid, cell) != piece) continue;
            nearest = vertex;
            best = dx * dx + dy * dy;
        }
    return nearest;
}

}  // namespace

TemplateCounts TemplateData::counts() const {
    return {vertices.size(),  triangles.size() / 3, nodes.size() / 3, edges.size(),
            landmarks.size(), patches.size(),       checks.size()};
}

bool TemplateData::is_faint() const { return defrec::is_faint(texture_level); }

size_t TemplateData::pieces() const {
    return node_piece.empty() ? 1
                              : size_t{*std::max_element(node_piece.begin(), node_piece.end())} + 1;
}

Template::Template(TemplateData data, std::weak_ptr<const Services> services)
    : Template(std::move(data), std::make_shared<BodySlot>(std::move(services)),
               std::make_shared<const int>()) {}

Template::Template(TemplateData data, const Template& before)
    : Template(std::move(data), std::make_shared<BodySlot>(before.body_), before.lineage_) {}

Template::Template(TemplateData data, std::shared_ptr<BodySlot> body,
                   std::shared_ptr<const int> lineage)
    : data_(std::move(data)),
      cut_points_(cut_points(data_)),
      vertex_pieces_(data_.vertices.size()),
      index_(data_.parts.empty() ? nullptr : std::make_unique<SurfaceIndex>(data_)),
      nearest_surface_(std::make_unique<NearestSurface>(data_)),
      body_(std::move(body)),
      lineage_(std::move(lineage)) {
    std::transform(data_.vertices.begin(), data_.vertices.end(), vertex_pieces_.begin(),
                   [&](const defrec_surface_point& vertex) { return data_.piece_of(vertex); });
}

Template::~Template() = default;

BodySurface Template::body_surface() const {
    return {data_.vertices, vertex_pieces_, data_.pieces(), cut_points_};
}

void Template::start_body() const { body_->start(body_surface()); }

const BodySlot& Template::body() const {
    body_->follow_lineage(body_surface());
    return *body_;
}

defrec_status Template::wait_body(uint64_t timeout_ns) const {
    body_->follow_lineage(body_surface());
    return body_->wait(body_surface(), timeout_ns);
}

void Template::set_body(const defrec_body_desc* desc) const {
    body_->describe(desc != nullptr ? describe_body(*desc, data_.vertices) : nullptr,
                    body_surface());
}

void Template::info(defrec_template_info& out) const {
    out.width = data_.width;
    out.height = data_.height;
    out.camera = data_.camera;
    out.vertices = data_.vertices.data();
    out.vertex_count = data_.vertices.size();
    out.triangles = data_.triangles.data();
    out.triangle_count = data_.triangles.size() / 3;
    out.nodes = data_.nodes.data();
    out.node_count = data_.nodes.size() / 3;
    out.edges = data_.edges.data();
    out.edge_count = data_.edges.size();
    out.landmarks = data_.landmarks.data();
    out.landmark_count = data_.landmarks.size();
    out.patches = data_.patches.data();
    out.patch_count = data_.patches.size();
    out.image = data_.image.data();
    out.cut_points = cut_points_.data();
    out.cut_point_count = cut_points_.size();
    out.vertex_pieces = vertex_pieces_.data();
    out.piece_count = data_.pieces();
}

void Template::lift(const double* uv, size_t count, double* xyz, uint8_t* found) const {
    for (size_t i = 0; i < count; ++i) {
        double disparity = 0, support = 0;
        const double u = uv[2 * i], v = uv[2 * i + 1];
        const bool hit = grid_disparity(data_, u, v, disparity, support);
        const std::array<double, 3> point =
            hit ? back_project(data_.camera, u, v, disparity) : std::array<double, 3>{};
        std::copy(point.begin(), point.end(), xyz + 3 * i);
        found[i] = hit ? 1 : 0;
    }
}

void Template::point_pieces(const double* xyz, size_t count, uint8_t* pieces) const {
    constexpr uint8_t kNone = 255;
    for (size_t i = 0; i < count; ++i) {
        const double* point = xyz + 3 * i;
        const bool is_finite =
            std::all_of(point, point + 3, [](double c) { return std::isfinite(c); });
        pieces[i] = is_finite ? piece_at(point) : kNone;
    }
}

int32_t Template::grown_vertex(const double xyz[3]) const {
    if (index_ == nullptr) return -1;
    const int32_t vertex = index_->nearest_vertex(data_, xyz);
    return static_cast<int64_t>(vertex) >= static_cast<int64_t>(data_.first_counts().vertices)
               ? vertex
               : -1;
}

int32_t Template::vertex_at(const double xyz[3]) const {
    const int32_t grown = grown_vertex(xyz);
    return grown >= 0 ? grown : vertex_under(data_, piece_at(xyz), xyz);
}

uint8_t Template::piece_at(const double xyz[3]) const {
    if (data_.node_piece.empty()) return 0;
    if (const int32_t vertex = grown_vertex(xyz); vertex >= 0)
        return data_.piece_of(data_.vertices[static_cast<size_t>(vertex)]);
    if (const auto [u, v, is_valid] = pixel_of(data_, xyz); is_valid)
        if (const int piece = grid_piece(data_, u, v); piece >= 0)
            return static_cast<uint8_t>(piece);
    return data_.piece_of_node(nearest_surface_->nearest_node({xyz[0], xyz[1], xyz[2]}));
}

DualQuaternion<double> Template::motion_at(const double xyz[3],
                                           const defrec_motion* motions) const {
    return motion_of(anchor_of(xyz), motions);
}

PointAnchor Template::anchor_of(const double xyz[3]) const {
    if (const int32_t vertex = grown_vertex(xyz); vertex >= 0)
        return index_->anchor_of(data_, vertex, xyz);
    return {blend_weights_of(xyz), {}, false};
}

DualQuaternion<double> Template::motion_of(const PointAnchor& anchor,
                                           const defrec_motion* motions) const {
    const int32_t* node = anchor.weights.node.data();
    const float* weight = anchor.weights.weight.data();
    if (!anchor.is_grown) return blend<double>(motions, node, weight);
    DualQuaternion<double> corners[3];
    for (size_t c = 0; c < 3; ++c) {
        const defrec_surface_point& vertex = data_.vertices[anchor.corner[c]];
        corners[c] = blend<double>(motions, vertex.node, vertex.weight);
    }
    return blend<double>(corners, node, weight);
}

// The control points that move a point, on the first view's surface or off it.
BlendWeights Template::blend_weights_of(const double xyz[3]) const {
    BlendWeights blend_weights;
    const uint8_t piece = piece_at(xyz);
    if (xyz[2] > 0) {
        const double u = data_.camera.fx * xyz[0] / xyz[2] + data_.camera.cx;
        const double v = data_.camera.fy * xyz[1] / xyz[2] + data_.camera.cy;
        if (grid_blend_weights(data_.node_grid, piece, u, v, blend_weights)) return blend_weights;
    }
    // Beside the surface: the nearest control points, by inverse squared distance.
    std::vector<std::pair<double, int32_t>> nearest;
    nearest.reserve(data_.nodes.size() / 3);
    for (size_t i = 0; i < data_.nodes.size() / 3; ++i) {
        if (data_.piece_of_node(i) != piece) continue;
        double squared = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double difference = xyz[axis] - data_.nodes[3 * i + static_cast<size_t>(axis)];
            squared += difference * difference;
        }
        nearest.emplace_back(squared, static_cast<int32_t>(i));
    }
    const size_t used = std::min<size_t>(DEFREC_BLEND_NODES, nearest.size());
    std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(used),
                      nearest.end());
    double sum = 0;
    for (size_t k = 0; k < used; ++k) sum += 1 / (nearest[k].first + 1e-3);
    for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
        blend_weights.node[k] = k < used ? nearest[k].second : blend_weights.node[0];
        blend_weights.weight[k] =
            k < used ? static_cast<float>(1 / (nearest[k].first + 1e-3) / sum) : 0.f;
    }
    return blend_weights;
}

namespace {

// The four vertices of the surface's grid round a pixel, with bilinear weights.
struct Corners {
    bool is_inside = false;
    std::array<size_t, 4> cell{};
    std::array<double, 4> weight{};
};

Corners corners_of(const TemplateData& data, double u, double v) {
    const SurfaceGrid& grid = data.grid;
    Corners corners;
    corners.is_inside = u >= -0.5 && v >= -0.5 && u <= data.width - 0.5 && v <= data.height - 0.5;
    if (!corners.is_inside) return corners;
    const double x = std::clamp(u / grid.spacing, 0.0, grid.columns - 1.0);
    const double y = std::clamp(v / grid.spacing, 0.0, grid.rows - 1.0);
    const int x0 = std::min(static_cast<int>(x), grid.columns - 2),
              y0 = std::min(static_cast<int>(y), grid.rows - 2);
    const double fx = x - x0, fy = y - y0;
    for (int k = 0; k < 4; ++k) {
        const int dx = k % 2, dy = k / 2;
        const auto slot = static_cast<size_t>(k);
        corners.cell[slot] = static_cast<size_t>((y0 + dy) * grid.columns + x0 + dx);
        corners.weight[slot] = (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy);
    }
    return corners;
}

bool belongs(const SurfaceGrid& grid, size_t cell, int piece) {
    return grid.vertex[cell] >= 0 && piece_at(grid, cell) == piece;
}

// Where enough of the weight is the piece's.
bool disparity_at(const SurfaceGrid& grid, const Corners& corners, int piece, double& disparity,
                  double& support) {
    double sum = 0, value = 0, distance = 0;
    for (size_t k = 0; k < 4; ++k) {
        const size_t index = corners.cell[k];
        if (!belongs(grid, index, piece)) continue;
        sum += corners.weight[k];
        value += corners.weight[k] * grid.disparity[index];
        distance += corners.weight[k] * grid.support[index];
    }
    if (sum < decisions::PointWeights::kMinPieceWeight) return false;
    disparity = value / sum;
    support = distance / sum;
    return true;
}

int piece_of_corners(const SurfaceGrid& grid, const Corners& corners) {
    if (!corners.is_inside) return -1;
    if (grid.piece.empty()) return 0;
    int heaviest = -1;
    double most = 0;
    for (size_t k = 0; k < 4; ++k) {
        if (grid.vertex[corners.cell[k]] < 0) continue;
        const int piece = grid.piece[corners.cell[k]];
        double sum = 0;
        for (size_t other = 0; other < 4; ++other)
            if (belongs(grid, corners.cell[other], piece)) sum += corners.weight[other];
        if (sum <= most) continue;
        most = sum;
        heaviest = piece;
    }
    return most < decisions::PointWeights::kMinPieceWeight ? -1 : heaviest;
}

}  // namespace

int grid_piece(const TemplateData& data, double u, double v) {
    const Corners corners = corners_of(data, u, v);
    const int piece = piece_of_corners(data.grid, corners);
    double disparity = 0, support = 0;
    return piece >= 0 && disparity_at(data.grid, corners, piece, disparity, support) ? piece : -1;
}

bool grid_disparity(const TemplateData& data, int piece, double u, double v, double& disparity,
                    double& support) {
    const Corners corners = corners_of(data, u, v);
    return corners.is_inside && disparity_at(data.grid, corners, piece, disparity, support);
}

bool grid_disparity(const TemplateData& data, double u, double v, double& disparity,
                    double& support) {
    const Corners corners = corners_of(data, u, v);
    const int piece = piece_of_corners(data.grid, corners);
    return piece >= 0 && disparity_at(data.grid, corners, piece, disparity, support);
}

namespace {

// The cell of the control points' grid that a pixel lies in, and where in it.
struct GridCell {
    int x0, y0;
    double fx, fy;  // 0 to 1
    GridCell(const NodeGrid& grid, double u, double v) {
        const double x = std::clamp(u / grid.spacing_u, 0.0, grid.columns - 1.0);
        const double y = std::clamp(v / grid.spacing_v, 0.0, grid.rows - 1.0);
        x0 = std::min(static_cast<int>(x), grid.columns - 2);
        y0 = std::min(static_cast<int>(y), grid.rows - 2);
        fx = x - x0;
        fy = y - y0;
    }
    int32_t node(const NodeGrid& grid, size_t piece, int dx, int dy) const {
        return grid
            .node[piece * grid.cells() + static_cast<size_t>((y0 + dy) * grid.columns + x0 + dx)];
    }
    // Whether a pixel and that control point of its cell, or of one round it, are not parted.
    bool joins(const NodeGrid& grid, size_t piece, double u, double v, int dx, int dy) const {
        return !is_parted(grid.cuts, piece, {u, v},
                          {(x0 + dx) * grid.spacing_u, (y0 + dy) * grid.spacing_v});
    }
};

// Where all control points round a pixel lie beyond a cut: the nearest one of the cells round it
// that does not; -1: there is none.
int32_t nearest_joined(const NodeGrid& grid, size_t piece, double u, double v) {
    constexpr int kReach = decisions::PointWeights::kCutReach;
    const GridCell cell(grid, u, v);
    int32_t nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int dy = -kReach; dy <= kReach + 1; ++dy)
        for (int dx = -kReach; dx <= kReach + 1; ++dx) {
            if (cell.x0 + dx < 0 || cell.y0 + dy < 0 || cell.x0 + dx >= grid.columns ||
                cell.y0 + dy >= grid.rows)
                continue;
            const int32_t node = cell.node(grid, piece, dx, dy);
            const double distance = std::hypot(dx - cell.fx, dy - cell.fy);
            if (node < 0 || distance >= least || !cell.joins(grid, piece, u, v, dx, dy)) continue;
            nearest = node;
            least = distance;
        }
    return nearest;
}

}  // namespace

bool grid_blend_weights(const NodeGrid& grid, size_t piece, double u, double v,
                        BlendWeights& blend_weights) {
    if (!grid.has_piece(piece)) return false;
    const GridCell cell(grid, u, v);
    double sum = 0;
    int used = 0, parted = 0;
    blend_weights = BlendWeights{};
    for (int dy = 0; dy < 2; ++dy)
        for (int dx = 0; dx < 2; ++dx) {
            const int32_t node = cell.node(grid, piece, dx, dy);
            const double weight = (dx ? cell.fx : 1 - cell.fx) * (dy ? cell.fy : 1 - cell.fy);
            if (node < 0) continue;
            if (!cell.joins(grid, piece, u, v, dx, dy)) {
                ++parted;
                continue;
            }
            blend_weights.node[static_cast<size_t>(used)] = node;
            blend_weights.weight[static_cast<size_t>(used)] = static_cast<float>(weight);
            sum += weight;
            ++used;
        }
    if (used == 0 && parted > 0) {
        const int32_t node = nearest_joined(grid, piece, u, v);
        if (node < 0) return false;
        blend_weights.node[0] = node;
        used = 1;
    }
    if (used == 0) return false;
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
        const size_t slot = static_cast<size_t>(k);
        if (k >= used) {
            blend_weights.node[slot] = blend_weights.node[0];
            blend_weights.weight[slot] = 0;
        } else {
            blend_weights.weight[slot] = sum > 1e-6
                                             ? static_cast<float>(blend_weights.weight[slot] / sum)
                                             : 1.f / static_cast<float>(used);
        }
    }
    return true;
}

defrec_patch_slope grid_slope(const NodeGrid& grid, size_t piece, double u, double v) {
    if (!grid.has_piece(piece)) return {};
    const GridCell cell(grid, u, v);
    defrec_patch_slope slope{};
    for (int k = 0; k < 4; ++k) {  // in the order of grid_blend_weights
        const int dx = k % 2, dy = k / 2;
        if (cell.node(grid, piece, dx, dy) < 0 || !cell.joins(grid, piece, u, v, dx, dy)) return {};
        slope.weight_u[k] =
            static_cast<float>((dx ? 1 : -1) * (dy ? cell.fy : 1 - cell.fy) / grid.spacing_u);
        slope.weight_v[k] =
            static_cast<float>((dy ? 1 : -1) * (dx ? cell.fx : 1 - cell.fx) / grid.spacing_v);
    }
    return slope;
}

std::array<double, 3> back_project(const defrec_camera& camera, double u, double v,
                                   double disparity) {
    const double z = camera.fx * camera.baseline_mm / disparity;
    return {(u - camera.cx) * z / camera.fx, (v - camera.cy) * z / camera.fy, z};
}

}  // namespace defrec
