// See growth.hpp.
#include "sdk/template/growth.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "backends/shared/motion.hpp"
#include "sdk/base/median.hpp"
#include "sdk/template/check_patches.hpp"
#include "sdk/template/node_edges.hpp"
#include "sdk/template/page.hpp"
#include "sdk/template/patch_places.hpp"
#include "sdk/template/scattered_skin.hpp"
#include "sdk/template/surface.hpp"
#include "sdk/template/surface_point.hpp"

namespace defrec {
namespace {

using Motion = DualQuaternion<double>;
using Point = Vec3<double>;

constexpr double kMaxMisfitMm = 1;    // median distance of the surface from live depth
constexpr double kMinOverlap = 0.15;  // share of the image with surface that was found
constexpr size_t kMinNew = 12;        // vertices of a piece of tissue that joins
constexpr size_t kMaxHole = 60;       // of a hole that is filled: a highlight, say
constexpr double kSameDepth = 0.02;   // share of the depth by which two frames may disagree
constexpr int kMargin = 4;            // cells round what is new that a part of the grid keeps
constexpr double kPatchReach = 48;    // px round a patch that its search may sample
constexpr int kBorder = 20;           // px; a page has other tissue beyond the image's rim

Point as_point(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// Builds one grown template.
class Grower {
  public:
    Grower(const TemplateData& data, const FoundFrame& earlier, const FoundFrame& now)
        : old_(data), earlier_(earlier), now_(now) {}

    Growth grow(size_t max_vertices);

  private:
    // A control point that may be added.
    struct NewNode {
        double u, v;  // px
        Point place;
        NodeAnchor anchor;
        Motion motion, earlier_motion;
    };

    bool fit_view();
    void project_surface();
    void cover(const std::array<size_t, 3>& corners);
    bool fits() const;
    void find_candidates();
    void place_nodes();
    const NewNode* nearest_new_node(double u, double v) const;
    void keep_what_was_seen();
    bool was_seen(size_t cell) const;
    void keep_whole_pieces();
    void fill_holes();
    template <class Belongs>
    std::vector<size_t> connected(size_t seed, std::vector<uint8_t>& done, Belongs&& belongs) const;
    void append_nodes(Growth& growth);
    void append_vertices(TemplateData& data);
    void append_triangles(TemplateData& data);
    void crop_part(TemplateData& data);
    void append_landmarks(TemplateData& data);
    bool append_patches(TemplateData& data);
    void append_checks(TemplateData& data, std::vector<defrec_patch>& checks);
    bool store_pieces(TemplateData& data, std::span<defrec_patch*> patches, const PixelBox& box);

    bool carry_point(double u, double v, defrec_surface_point& point) const;
    bool carry_patch(double u, double v, defrec_patch& patch) const;
    bool carry(double u, double v, defrec_surface_point& point, SurfacePlace& place,
               Motion& motion) const;

    double cell_u(size_t cell) const {
        return std::min<double>(static_cast<double>(cell % columns()) * seen_.grid.spacing,
                                seen_.width - 1.0);
    }
    double cell_v(size_t cell) const {
        const size_t row = cell / columns();
        return std::min<double>(static_cast<double>(row) * seen_.grid.spacing, seen_.height - 1.0);
    }
    size_t columns() const { return static_cast<size_t>(seen_.grid.columns); }
    size_t cells() const { return seen_.grid.vertex.size(); }
    // The cell nearest to a pixel.
    size_t cell_at(double u, double v) const {
        const double s = seen_.grid.spacing;
        const auto x =
            static_cast<size_t>(std::clamp<long>(std::lround(u / s), 0, seen_.grid.columns - 1));
        const auto y =
            static_cast<size_t>(std::clamp<long>(std::lround(v / s), 0, seen_.grid.rows - 1));
        return y * columns() + x;
    }
    Point place_of(double u, double v, double disparity) const {
        const auto p = back_project(old_.camera, u, v, disparity);
        return {p[0], p[1], p[2]};
    }
    double pixel_u(const Point& p) const { return old_.camera.fx * p.x / p.z + old_.camera.cx; }
    double pixel_v(const Point& p) const { return old_.camera.fy * p.y / p.z + old_.camera.cy; }

    const TemplateData& old_;
    const FoundFrame &earlier_, &now_;
    double scale_ = 1;   // px now for a px of the first view, for the same length on the surface
    TemplateData seen_;  // the surface of the frame now: size, camera and grid alone
    std::vector<Point> at_, node_at_;  // the template in the frame, mm
    std::vector<float> covered_;       // per cell: depth of the template's surface, 0: none
    std::vector<uint8_t> is_new_;      // per cell
    std::optional<PixelBuckets> vertices_, nodes_;  // of the template in the image; then all nodes
    std::vector<NewNode> new_nodes_;
    std::vector<Motion> motions_;  // of all control points
    double node_spacing_ = 0;      // px
    GrownPart part_;               // over the whole image until it is cropped
};

// The surface in the frame now, at the spacing on the tissue that the first view had.
bool Grower::fit_view() {
    std::vector<double> rest_depth, depth;
    for (const defrec_surface_point& vertex : old_.vertices) {
        const Point p = apply(blend<double>(now_.motions.data(), vertex.node, vertex.weight),
                              load3<double>(vertex.position));
        at_.push_back(p);
        if (!(p.z > 1)) continue;
        if (at_.size() <= old_.first_counts().vertices) rest_depth.push_back(vertex.position[2]);
        const double u = pixel_u(p), v = pixel_v(p);
        if (u >= 0 && v >= 0 && u < old_.width && v < old_.height) depth.push_back(p.z);
    }
    if (depth.empty() || rest_depth.empty()) return false;
    scale_ = std::clamp(median(rest_depth) / median(depth), 0.5, 4.0);
    node_at_ = node_positions(old_.nodes, now_.motions);
    CaptureInput input = now_.images;
    input.vertex_spacing_px = std::max(4.0, scale_ * old_.grid.spacing);
    node_spacing_ = scale_ * old_.node_grid.spacing_u;
    seen_.width = input.width;
    seen_.height = input.height;
    seen_.camera = input.camera;
    return fit_surface(input, seen_.grid);
}

void Grower::project_surface() {
    std::vector<PixelPoint> points;
    for (size_t i = 0; i < at_.size(); ++i)
        if (at_[i].z > 1)
            points.push_back({static_cast<int32_t>(i), pixel_u(at_[i]), pixel_v(at_[i])});
    vertices_.emplace(points, seen_.grid.spacing);
    covered_.assign(cells(), 0);
    for (size_t i = 0; i + 2 < old_.triangles.size(); i += 3)
        cover({old_.triangles[i], old_.triangles[i + 1], old_.triangles[i + 2]});
}

// Marks the cells under a triangle.
void Grower::cover(const std::array<size_t, 3>& corners) {
    double u[3], v[3];
    for (size_t k = 0; k < 3; ++k) {
        if (!(at_[corners[k]].z > 1)) return;
        u[k] = pixel_u(at_[corners[k]]);
        v[k] = pixel_v(at_[corners[k]]);
    }
    const double area = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]);
    if (std::abs(area) < 1e-9) return;
    const double s = seen_.grid.spacing;
    const auto first = [&](const double* x, int count) {
        return std::clamp(static_cast<int>(std::ceil(std::min({x[0], x[1], x[2]}) / s)), 0, count);
    };
    const auto last = [&](const double* x, int count) {
        return std::clamp(static_cast<int>(std::floor(std::max({x[0], x[1], x[2]}) / s)), -1,
                          count - 1);
    };
    for (int y = first(v, seen_.grid.rows); y <= last(v, seen_.grid.rows); ++y)
        for (int x = first(u, seen_.grid.columns); x <= last(u, seen_.grid.columns); ++x) {
            const double pu = x * s, pv = y * s;
            double weight[3];
            for (size_t k = 0; k < 3; ++k) {
                const size_t a = (k + 1) % 3, b = (k + 2) % 3;
                weight[k] = ((u[a] - pu) * (v[b] - pv) - (u[b] - pu) * (v[a] - pv)) / area;
            }
            if (std::min({weight[0], weight[1], weight[2]}) < -1e-6) continue;
            const double depth = weight[0] * at_[corners[0]].z + weight[1] * at_[corners[1]].z +
                                 weight[2] * at_[corners[2]].z;
            float& cell = covered_[static_cast<size_t>(y) * columns() + static_cast<size_t>(x)];
            if (cell == 0 || depth < cell) cell = static_cast<float>(depth);
        }
}

// Whether what is seen lies where the surface was found.
bool Grower::fits() const {
    std::vector<double> misfit;
    for (size_t i = 0; i < cells(); ++i) {
        if (covered_[i] == 0 || seen_.grid.vertex[i] < 0 || seen_.grid.support[i] > 0) continue;
        const Point live = place_of(cell_u(i), cell_v(i), seen_.grid.disparity[i]);
        misfit.push_back(std::abs(live.z - covered_[i]));
    }
    return static_cast<double>(misfit.size()) >= kMinOverlap * static_cast<double>(cells()) &&
           median(misfit) <= kMaxMisfitMm;
}

// Cells with measured tissue and no surface, not closer to it than neighbours of the grid are.
void Grower::find_candidates() {
    is_new_.assign(cells(), 0);
    for (size_t i = 0; i < cells(); ++i)
        is_new_[i] = seen_.grid.vertex[i] >= 0 && seen_.grid.support[i] <= seen_.grid.spacing &&
                     covered_[i] == 0 &&
                     vertices_->nearest(cell_u(i), cell_v(i), 0.5 * seen_.grid.spacing) == nullptr;
}

// Control points on a grid over the image, as a template has them, where there is new tissue within
// one and a half spacings and no control point is near.
void Grower::place_nodes() {
    std::vector<PixelPoint> fresh, present;
    for (size_t i = 0; i < cells(); ++i)
        if (is_new_[i] != 0) fresh.push_back({static_cast<int32_t>(i), cell_u(i), cell_v(i)});
    for (size_t i = 0; i < node_at_.size(); ++i)
        if (node_at_[i].z > 1)
            present.push_back(
                {static_cast<int32_t>(i), pixel_u(node_at_[i]), pixel_v(node_at_[i])});
    const PixelBuckets new_cells(fresh, node_spacing_);
    nodes_.emplace(present, node_spacing_);
    const int across =
        std::max(2, static_cast<int>(std::lround((seen_.width - 1) / node_spacing_)) + 1);
    const int down =
        std::max(2, static_cast<int>(std::lround((seen_.height - 1) / node_spacing_)) + 1);
    for (int y = 0; y < down; ++y)
        for (int x = 0; x < across; ++x) {
            const double u = x * (seen_.width - 1.0) / (across - 1),
                         v = y * (seen_.height - 1.0) / (down - 1);
            double disparity = 0, support = 0;
            if (!grid_disparity(seen_, u, v, disparity, support) ||
                nodes_->nearest(u, v, 0.65 * node_spacing_) != nullptr ||
                new_cells.nearest(u, v, 1.5 * node_spacing_) == nullptr)
                continue;
            NewNode node{
                u, v, place_of(u, v, disparity), {}, Motion::identity(), Motion::identity()};
            node.anchor = anchor_at(node_at_, old_.node_spacing_mm, node.place);
            node.motion = follow_anchor(node.anchor, old_.nodes, now_.motions);
            node.earlier_motion = follow_anchor(node.anchor, old_.nodes, earlier_.motions);
            new_nodes_.push_back(node);
        }
}

const Grower::NewNode* Grower::nearest_new_node(double u, double v) const {
    const NewNode* nearest = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const NewNode& node : new_nodes_) {
        const double squared = (node.u - u) * (node.u - u) + (node.v - v) * (node.v - v);
        if (squared >= least) continue;
        least = squared;
        nearest = &node;
    }
    return nearest;
}

// Whether the earlier frame shows a surface where the cell's tissue was then, if it moves with the
// tissue beside it.
bool Grower::was_seen(size_t cell) const {
    const double u = cell_u(cell), v = cell_v(cell);
    const NewNode* node = nearest_new_node(u, v);
    Motion now = Motion::identity(), then = now;
    if (node != nullptr) {
        now = node->motion;
        then = node->earlier_motion;
    } else {
        const NodeAnchor anchor =
            anchor_at(node_at_, old_.node_spacing_mm, place_of(u, v, seen_.grid.disparity[cell]));
        now = follow_anchor(anchor, old_.nodes, now_.motions);
        then = follow_anchor(anchor, old_.nodes, earlier_.motions);
    }
    const Point p = apply(compose(then, inverse(now)), place_of(u, v, seen_.grid.disparity[cell]));
    if (!(p.z > 1)) return false;
    constexpr int kReach = 2;
    const long x = std::lround(pixel_u(p)), y = std::lround(pixel_v(p));
    const CaptureInput& images = earlier_.images;
    if (x < kReach || y < kReach || x + kReach >= static_cast<long>(images.width) ||
        y + kReach >= static_cast<long>(images.height))
        return false;
    const double at_one =
        double{DEFREC_DISPARITY_ONE} * images.camera.fx * images.camera.baseline_mm;
    for (long dy = -kReach; dy <= kReach; ++dy)
        for (long dx = -kReach; dx <= kReach; ++dx) {
            const int16_t raw = images.disparity[static_cast<size_t>(y + dy) * images.width +
                                                 static_cast<size_t>(x + dx)];
            if (raw > 0 && std::abs(at_one / raw - p.z) <= kSameDepth * p.z) return true;
        }
    return false;
}

void Grower::keep_what_was_seen() {
    for (size_t i = 0; i < cells(); ++i)
        if (is_new_[i] != 0 && !was_seen(i)) is_new_[i] = 0;
}

// The cells that are connected to a seed and belong, the seed first. done: cells that were visited.
template <class Belongs>
std::vector<size_t> Grower::connected(size_t seed, std::vector<uint8_t>& done,
                                      Belongs&& belongs) const {
    std::vector<size_t> piece{seed};
    done[seed] = 1;
    for (size_t next = 0; next < piece.size(); ++next) {
        const int x = static_cast<int>(piece[next] % columns()),
                  y = static_cast<int>(piece[next] / columns());
        for (const auto& [nx, ny] : {std::pair{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
            if (nx < 0 || ny < 0 || nx >= seen_.grid.columns || ny >= seen_.grid.rows) continue;
            const size_t other = static_cast<size_t>(ny) * columns() + static_cast<size_t>(nx);
            if (done[other] != 0 || !belongs(other)) continue;
            done[other] = 1;
            piece.push_back(other);
        }
    }
    return piece;
}

// Of connected pieces of new cells those that are large enough and touch the surface.
void Grower::keep_whole_pieces() {
    std::vector<uint8_t> done(cells(), 0);
    const auto belongs = [&](size_t cell) { return is_new_[cell] == 1; };
    const auto touches = [&](size_t cell) {
        return vertices_->nearest(cell_u(cell), cell_v(cell), 1.5 * seen_.grid.spacing) != nullptr;
    };
    for (size_t seed = 0; seed < cells(); ++seed) {
        if (done[seed] != 0 || !belongs(seed)) continue;
        const std::vector<size_t> piece = connected(seed, done, belongs);
        if (piece.size() >= kMinNew && std::any_of(piece.begin(), piece.end(), touches)) continue;
        for (const size_t cell : piece) is_new_[cell] = 0;
    }
}

// Small places without depth amid tissue, as a first view's surface has none either.
void Grower::fill_holes() {
    std::vector<uint8_t> done(cells(), 0);
    const auto belongs = [&](size_t cell) {
        return is_new_[cell] == 0 && covered_[cell] == 0 &&
               vertices_->nearest(cell_u(cell), cell_v(cell), 0.5 * seen_.grid.spacing) == nullptr;
    };
    const auto can_join = [&](size_t cell) {
        const size_t x = cell % columns(), y = cell / columns();
        return seen_.grid.vertex[cell] >= 0 && x > 0 && y > 0 && x + 1 < columns() &&
               y + 1 < static_cast<size_t>(seen_.grid.rows);
    };
    for (size_t seed = 0; seed < cells(); ++seed) {
        if (done[seed] != 0 || !belongs(seed)) continue;
        const std::vector<size_t> hole = connected(seed, done, belongs);
        if (hole.size() > kMaxHole || !std::all_of(hole.begin(), hole.end(), can_join)) continue;
        for (const size_t cell : hole) is_new_[cell] = 1;
    }
}

void Grower::append_nodes(Growth& growth) {
    TemplateData& data = growth.data;
    std::vector<PixelPoint> fresh, all;
    for (size_t i = 0; i < cells(); ++i)
        if (is_new_[i] != 0) fresh.push_back({static_cast<int32_t>(i), cell_u(i), cell_v(i)});
    const PixelBuckets new_cells(fresh, node_spacing_);
    for (const defrec_motion& motion : now_.motions) motions_.push_back(Motion::load(motion));
    for (size_t i = 0; i < node_at_.size(); ++i)
        if (node_at_[i].z > 1)
            all.push_back({static_cast<int32_t>(i), pixel_u(node_at_[i]), pixel_v(node_at_[i])});
    for (const NewNode& node : new_nodes_) {
        if (new_cells.nearest(node.u, node.v, 1.5 * node_spacing_) == nullptr) continue;
        all.push_back({static_cast<int32_t>(motions_.size()), node.u, node.v});
        motions_.push_back(node.motion);
        growth.anchors.push_back(node.anchor);
        const Point rest = apply(inverse(node.motion), node.place);
        for (const double value : {rest.x, rest.y, rest.z})
            data.nodes.push_back(static_cast<float>(value));
    }
    nodes_.emplace(all, node_spacing_);
    connect_nodes(data, node_at_.size());
}

// The surface under a pixel carried back to the template frame.
bool Grower::carry(double u, double v, defrec_surface_point& point, SurfacePlace& place,
                   Motion& motion) const {
    Skin skin;
    if (!surface_place(seen_, u, v, place) || !scattered_skin(*nodes_, node_spacing_, u, v, skin))
        return false;
    motion = blend<double>(motions_.data(), skin.node.data(), skin.weight.data());
    store3(apply(inverse(motion), as_point(place.position)), point.position);
    store3(rotate(conjugate(motion.real), as_point(place.normal)), point.normal);
    std::copy(skin.node.begin(), skin.node.end(), point.node);
    std::copy(skin.weight.begin(), skin.weight.end(), point.weight);
    return true;
}

bool Grower::carry_point(double u, double v, defrec_surface_point& point) const {
    SurfacePlace place;
    Motion motion = Motion::identity();
    return carry(u, v, point, place, motion);
}

bool Grower::carry_patch(double u, double v, defrec_patch& patch) const {
    defrec_surface_point point{};
    SurfacePlace place;
    Motion motion = Motion::identity();
    if (!carry(u, v, point, place, motion)) return false;
    patch = {};
    patch.u = static_cast<float>(u);
    patch.v = static_cast<float>(v);
    std::copy(std::begin(point.position), std::end(point.position), patch.position);
    store3(rotate(conjugate(motion.real), as_point(place.tangent_u)), patch.tangent_u);
    store3(rotate(conjugate(motion.real), as_point(place.tangent_v)), patch.tangent_v);
    std::copy(std::begin(point.node), std::end(point.node), patch.node);
    std::copy(std::begin(point.weight), std::end(point.weight), patch.weight);
    return true;
}

void Grower::append_vertices(TemplateData& data) {
    part_.before = old_.counts();
    part_.columns = seen_.grid.columns;
    part_.rows = seen_.grid.rows;
    part_.min_disparity = std::numeric_limits<float>::max();
    part_.vertex.assign(cells(), -1);
    std::vector<double> steps;
    for (size_t i = 0; i < cells(); ++i) {
        if (seen_.grid.vertex[i] >= 0 && seen_.grid.support[i] <= 0) {
            part_.min_disparity = std::min(part_.min_disparity, seen_.grid.disparity[i]);
            part_.max_disparity = std::max(part_.max_disparity, seen_.grid.disparity[i]);
        }
        defrec_surface_point point{};
        if (is_new_[i] == 0 || !carry_point(cell_u(i), cell_v(i), point)) {
            is_new_[i] = 0;
            continue;
        }
        part_.vertex[i] = static_cast<int32_t>(data.vertices.size());
        data.vertices.push_back(point);
        // What counts is the distance on the tissue, for which it is multiplied by the depth at
        // rest.
        const double depth = place_of(0, 0, seen_.grid.disparity[i]).z;
        data.vertex_support.push_back(
            static_cast<float>(seen_.grid.support[i] * depth / std::max(1.f, point.position[2])));
        steps.push_back(seen_.grid.spacing * depth / old_.camera.fx);
    }
    if (!steps.empty()) part_.step_mm = static_cast<float>(median(steps));
}

// Between new vertices, and from them to the nearest vertices of the surface that they join.
void Grower::append_triangles(TemplateData& data) {
    const double spacing = seen_.grid.spacing;
    for (size_t i = 0; i < cells(); ++i)
        if (part_.vertex[i] < 0)
            if (const PixelPoint* near = vertices_->nearest(cell_u(i), cell_v(i), 1.5 * spacing))
                part_.vertex[i] = near->index;
    const auto first_new = static_cast<int32_t>(part_.before.vertices);
    const auto pixel = [&](size_t cell) {
        const int32_t vertex = part_.vertex[cell];
        if (vertex >= first_new) return std::pair{cell_u(cell), cell_v(cell)};
        const Point& p = at_[static_cast<size_t>(vertex)];
        return std::pair{pixel_u(p), pixel_v(p)};
    };
    // Of three cells; false where they make no triangle.
    const auto add = [&](size_t a, size_t b, size_t c) {
        const int32_t i = part_.vertex[a], j = part_.vertex[b], k = part_.vertex[c];
        if (i < 0 || j < 0 || k < 0 || std::max({i, j, k}) < first_new) return false;
        const auto [ua, va] = pixel(a);
        const auto [ub, vb] = pixel(b);
        const auto [uc, vc] = pixel(c);
        // Counter-clockwise seen from the camera: clockwise where v points down, as here it does.
        const double area = (ub - ua) * (vc - va) - (uc - ua) * (vb - va);
        if (i == j || j == k || i == k || area > -0.02 * spacing * spacing) return false;
        for (const int32_t index : {i, j, k})
            data.triangles.push_back(static_cast<uint32_t>(index));
        return true;
    };
    for (int y = 0; y + 1 < seen_.grid.rows; ++y)
        for (int x = 0; x + 1 < seen_.grid.columns; ++x) {
            const size_t a = static_cast<size_t>(y) * columns() + static_cast<size_t>(x), b = a + 1,
                         c = a + columns(), d = c + 1;
            const bool upper = add(a, c, b), lower = add(b, c, d);
            if (upper || lower) continue;
            // One corner may be missing.
            if (!add(a, d, b)) add(a, c, d);
        }
}

// Leaves of the grid what is new and its surroundings. The offset stays even, so that every second
// cell is the same before and after.
void Grower::crop_part(TemplateData& data) {
    int x0 = part_.columns, y0 = part_.rows, x1 = 0, y1 = 0;
    for (int y = 0; y < part_.rows; ++y)
        for (int x = 0; x < part_.columns; ++x)
            if (is_new_[static_cast<size_t>(y) * columns() + static_cast<size_t>(x)] != 0) {
                x0 = std::min(x0, x);
                y0 = std::min(y0, y);
                x1 = std::max(x1, x + 1);
                y1 = std::max(y1, y + 1);
            }
    x0 = std::max(0, x0 - kMargin) / 2 * 2;
    y0 = std::max(0, y0 - kMargin) / 2 * 2;
    x1 = std::min(part_.columns, x1 + kMargin);
    y1 = std::min(part_.rows, y1 + kMargin);
    GrownPart& part = data.parts.emplace_back(part_);
    part.columns = x1 - x0;
    part.rows = y1 - y0;
    part.vertex.clear();
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x)
            part.vertex.push_back(
                part_.vertex[static_cast<size_t>(y) * columns() + static_cast<size_t>(x)]);
}

void Grower::append_landmarks(TemplateData& data) {
    for (const defrec_feature& feature : now_.images.features) {
        const double u = feature.x / 16.0, v = feature.y / 16.0;
        double disparity = 0, support = 0;
        defrec_surface_point point{};
        if (is_new_[cell_at(u, v)] == 0 || !grid_disparity(seen_, u, v, disparity, support) ||
            support > seen_.grid.spacing || !carry_point(u, v, point))
            continue;
        defrec_landmark landmark{};
        std::copy(std::begin(feature.descriptor), std::end(feature.descriptor),
                  landmark.descriptor);
        std::copy(std::begin(point.position), std::end(point.position), landmark.position);
        data.landmarks.push_back(landmark);
        data.landmark_points.push_back(point);
    }
}

// Patches and checks with the pieces of the image that they are taken from; false where no view is
// left for these.
bool Grower::append_patches(TemplateData& data) {
    const size_t first_patch = data.patches.size(), first_check = data.checks.size();
    const auto has_new_surface = [&](int u, int v) {
        double disparity = 0, support = 0;
        return is_new_[cell_at(u, v)] != 0 && grid_disparity(seen_, u, v, disparity, support) &&
               support <= seen_.grid.spacing;
    };
    for (const Pixel pixel :
         trackable_pixels(now_.images, std::max(12.0, scale_ * patch_cell(now_.images)), kBorder,
                          has_new_surface)) {
        defrec_patch patch{};
        if (carry_patch(pixel.u, pixel.v, patch)) data.patches.push_back(patch);
    }
    append_checks(data, data.checks);
    std::vector<defrec_patch*> taken;
    for (size_t i = first_patch; i < data.patches.size(); ++i) taken.push_back(&data.patches[i]);
    for (size_t i = first_check; i < data.checks.size(); ++i) taken.push_back(&data.checks[i]);
    return store_pieces(data, taken, {0, 0, seen_.width, seen_.height});
}

// As place_checks does for the first view; also for the rim of the surface that was there, which
// had no whole window in its own view.
void Grower::append_checks(TemplateData& data, std::vector<defrec_patch>& checks) {
    const double window = (2 * kCheckRadius + 1) << check_level(seen_.width);
    const int step = std::max(1, static_cast<int>(window / seen_.grid.spacing));
    data.check_of_vertex.resize(data.vertices.size(), -1);
    std::vector<float> distance(cells());
    for (size_t i = 0; i < cells(); ++i) distance[i] = is_new_[i] != 0 ? 0.f : 1e9f;
    spread_distance(distance, seen_.grid.columns, seen_.grid.rows);
    for (int y0 = 0; y0 < seen_.grid.rows; y0 += step)
        for (int x0 = 0; x0 < seen_.grid.columns; x0 += step) {
            std::vector<size_t> within;  // vertices without a check
            for (int y = y0; y < std::min(y0 + step, seen_.grid.rows); ++y)
                for (int x = x0; x < std::min(x0 + step, seen_.grid.columns); ++x) {
                    const size_t cell = static_cast<size_t>(y) * columns() + static_cast<size_t>(x);
                    if (const int32_t vertex = part_.vertex[cell];
                        vertex >= 0 && distance[cell] <= static_cast<float>(2 * step) &&
                        data.check_of_vertex[static_cast<size_t>(vertex)] < 0)
                        within.push_back(static_cast<size_t>(vertex));
                }
            const double u = (x0 + 0.5 * (step - 1)) * seen_.grid.spacing,
                         v = (y0 + 0.5 * (step - 1)) * seen_.grid.spacing;
            defrec_patch check{};
            if (within.empty() ||
                !has_check_texture(now_.images.gray, seen_.width, seen_.height, u, v) ||
                !carry_patch(u, v, check))
                continue;
            for (const size_t vertex : within)
                data.check_of_vertex[vertex] = static_cast<int32_t>(checks.size());
            checks.push_back(check);
        }
}

// Copies the image round the patches to pages, in pieces of which they fill a good part. box: in
// which they lie.
bool Grower::store_pieces(TemplateData& data, std::span<defrec_patch*> patches,
                          const PixelBox& box) {
    if (patches.empty()) return true;
    double u0 = box.x1, v0 = box.y1, u1 = box.x0, v1 = box.y0;
    for (const defrec_patch* patch : patches) {
        u0 = std::min<double>(u0, patch->u);
        v0 = std::min<double>(v0, patch->v);
        u1 = std::max<double>(u1, patch->u);
        v1 = std::max<double>(v1, patch->v);
    }
    const double across = u1 - u0, down = v1 - v0;
    // Where patches lie as densely as they do in a filled piece, the piece is worth its place.
    const double cell = std::max(12.0, scale_ * patch_cell(now_.images));
    const double filled = static_cast<double>(patches.size()) * cell * cell;
    if (across * down > 2 * filled && std::max(across, down) > 4 * kPatchReach) {
        const bool by_u = across > down;
        const double middle = by_u ? (u0 + u1) / 2 : (v0 + v1) / 2;
        const auto half = std::stable_partition(
            patches.begin(), patches.end(),
            [&](const defrec_patch* p) { return (by_u ? p->u : p->v) < middle; });
        const auto split = static_cast<size_t>(half - patches.begin());
        return store_pieces(data, patches.first(split), box) &&
               store_pieces(data, patches.subspan(split), box);
    }
    const auto low = [](double x) { return static_cast<uint32_t>(std::max(0.0, x - kPatchReach)); };
    const PixelBox piece{low(u0), low(v0),
                         std::min(data.width, static_cast<uint32_t>(u1 + kPatchReach) + 1),
                         std::min(data.height, static_cast<uint32_t>(v1 + kPatchReach) + 1)};
    const std::optional<PagePlace> place = add_to_pages(data, now_.images.gray, piece);
    if (!place) return false;
    for (defrec_patch* patch : patches) {
        patch->u += static_cast<float>(place->du);
        patch->v += static_cast<float>(place->dv);
        patch->view = place->view;
    }
    return true;
}

Growth Grower::grow(size_t max_vertices) {
    Growth growth;
    const auto end = [&](Growth::Outcome outcome) {
        Growth none;
        none.outcome = outcome;
        return none;
    };
    if (!fit_view()) return end(Growth::Outcome::kNothingNew);
    project_surface();
    if (!fits()) return end(Growth::Outcome::kUnfit);
    find_candidates();
    place_nodes();
    keep_what_was_seen();
    keep_whole_pieces();
    if (std::count(is_new_.begin(), is_new_.end(), 1) > 0) fill_holes();
    const auto found = static_cast<size_t>(std::count(is_new_.begin(), is_new_.end(), 1));
    if (found == 0) return growth;
    if (old_.vertices.size() + found > max_vertices) return end(Growth::Outcome::kFull);
    growth.data = old_;
    append_nodes(growth);
    append_vertices(growth.data);
    if (growth.data.vertices.size() == old_.vertices.size())
        return end(Growth::Outcome::kNothingNew);
    append_triangles(growth.data);
    append_landmarks(growth.data);
    if (!append_patches(growth.data)) return end(Growth::Outcome::kFull);
    crop_part(growth.data);
    growth.outcome = Growth::Outcome::kGrown;
    return growth;
}

}  // namespace

Growth grow_template(const TemplateData& data, const FoundFrame& earlier, const FoundFrame& now,
                     size_t max_vertices) {
    return Grower(data, earlier, now).grow(max_vertices);
}

void extend_motions(const std::vector<float>& nodes, std::span<const NodeAnchor> anchors,
                    std::vector<defrec_motion>& motions) {
    for (const NodeAnchor& anchor : anchors)
        motions.push_back(follow_anchor(anchor, nodes, motions).store());
}

}  // namespace defrec
