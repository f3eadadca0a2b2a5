// See new_tissue.hpp.
#include "sdk/template/new_tissue.hpp"

#include <array>
#include <limits>

#include "sdk/base/util/median.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/template/surface.hpp"

namespace defrec {
namespace {

using Motion = DualQuaternion<double>;
using Point = Vec3<double>;

using decisions::JoiningTissue;

class TissueFinder {
  public:
    TissueFinder(const TemplateData& data, const FoundFrame& earlier, const FoundFrame& now,
                 NewTissue& found)
        : old_(data), earlier_(earlier), now_(now), found_(found) {}

    Search find();

  private:
    bool fit_view();
    void project_surface();
    void cover(const std::array<size_t, 3>& corners);
    bool fits() const;
    void find_pieces();
    void find_candidates();
    void place_nodes();
    const NewTissue::Node* nearest_new_node(double u, double v, int piece) const;
    NearestNodes anchor_of(const Point& place, int piece) const;
    void keep_what_was_seen();
    bool was_seen(size_t cell) const;
    void keep_whole_pieces();
    void fill_holes();
    template <class Belongs>
    std::vector<size_t> connected(size_t seed, std::vector<uint8_t>& done, Belongs&& belongs) const;

    const TemplateData& old_;
    const FoundFrame &earlier_, &now_;
    NewTissue& found_;
    std::vector<float> covered_;     // per cell: depth of the template's surface, 0: none
    std::vector<uint8_t> covering_;  // and its piece
};

Search TissueFinder::find() {
    if (!fit_view()) return Search::kNothing;
    project_surface();
    if (!fits()) return Search::kUnfit;
    find_pieces();
    find_candidates();
    place_nodes();
    keep_what_was_seen();
    keep_whole_pieces();
    if (found_.count() == 0) return Search::kNothing;
    fill_holes();
    return Search::kFound;
}

// The surface in the frame now, at the spacing on the tissue that the first view had.
bool TissueFinder::fit_view() {
    found_.seen.width = now_.images.width;
    found_.seen.height = now_.images.height;
    found_.seen.camera = now_.images.camera;
    found_.seen.texture_level = now_.images.texture_level;
    std::vector<double> rest_depth, depth;
    for (const defrec_surface_point& vertex : old_.vertices) {
        const Point p = apply(blend<double>(now_.motions.data(), vertex.node, vertex.weight),
                              load3<double>(vertex.position));
        found_.vertex_at.push_back(p);
        if (!(p.z > JoiningTissue::kMinDepth)) continue;
        if (found_.vertex_at.size() <= old_.first_counts().vertices)
            rest_depth.push_back(vertex.position[2]);
        const double u = found_.pixel_u(p), v = found_.pixel_v(p);
        if (u >= 0 && v >= 0 && u < old_.width && v < old_.height) depth.push_back(p.z);
    }
    if (depth.empty() || rest_depth.empty()) return false;
    found_.scale = std::clamp(median(rest_depth) / median(depth), JoiningTissue::kMinScale,
                              JoiningTissue::kMaxScale);
    found_.node_at = node_positions(old_.nodes, now_.motions);
    CaptureInput input = now_.images;
    input.vertex_spacing_px =
        std::max(JoiningTissue::kMinSpacing, found_.scale * old_.grid.spacing);
    found_.node_spacing = found_.scale * old_.node_grid.spacing_u;
    return fit_surface(input, found_.seen.grid) > 0;
}

void TissueFinder::project_surface() {
    std::vector<PixelPoint> points;
    for (size_t i = 0; i < found_.vertex_at.size(); ++i)
        if (found_.vertex_at[i].z > JoiningTissue::kMinDepth)
            points.push_back({static_cast<int32_t>(i), found_.pixel_u(found_.vertex_at[i]),
                              found_.pixel_v(found_.vertex_at[i])});
    found_.vertices.emplace(points, found_.seen.grid.spacing);
    covered_.assign(found_.cells(), 0);
    covering_.assign(found_.cells(), 0);
    for (size_t i = 0; i + 2 < old_.triangles.size(); i += 3)
        cover({old_.triangles[i], old_.triangles[i + 1], old_.triangles[i + 2]});
}

// Marks the cells under a triangle.
void TissueFinder::cover(const std::array<size_t, 3>& corners) {
    double u[3], v[3];
    for (size_t k = 0; k < 3; ++k) {
        if (!(found_.vertex_at[corners[k]].z > JoiningTissue::kMinDepth)) return;
        u[k] = found_.pixel_u(found_.vertex_at[corners[k]]);
        v[k] = found_.pixel_v(found_.vertex_at[corners[k]]);
    }
    const double area = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]);
    if (std::abs(area) < 1e-9) return;
    const double s = found_.seen.grid.spacing;
    const auto first = [&](const double* x, int count) {
        return std::clamp(static_cast<int>(std::ceil(std::min({x[0], x[1], x[2]}) / s)), 0, count);
    };
    const auto last = [&](const double* x, int count) {
        return std::clamp(static_cast<int>(std::floor(std::max({x[0], x[1], x[2]}) / s)), -1,
                          count - 1);
    };
    for (int y = first(v, found_.seen.grid.rows); y <= last(v, found_.seen.grid.rows); ++y)
        for (int x = first(u, found_.seen.grid.columns); x <= last(u, found_.seen.grid.columns);
             ++x) {
            const double pu = x * s, pv = y * s;
            double weight[3];
            for (size_t k = 0; k < 3; ++k) {
                const size_t a = (k + 1) % 3, b = (k + 2) % 3;
                weight[k] = ((u[a] - pu) * (v[b] - pv) - (u[b] - pu) * (v[a] - pv)) / area;
            }
            if (std::min({weight[0], weight[1], weight[2]}) < -1e-6) continue;
            const double depth = weight[0] * found_.vertex_at[corners[0]].z +
                                 weight[1] * found_.vertex_at[corners[1]].z +
                                 weight[2] * found_.vertex_at[corners[2]].z;
            float& cell =
                covered_[static_cast<size_t>(y) * found_.columns() + static_cast<size_t>(x)];
            if (cell != 0 && depth >= cell) continue;
            cell = static_cast<float>(depth);
            covering_[static_cast<size_t>(y) * found_.columns() + static_cast<size_t>(x)] =
                old_.piece_of(old_.vertices[corners[0]]);
        }
}

// Whether what is seen lies where the surface was found.
bool TissueFinder::fits() const {
    std::vector<double> misfit;
    for (size_t i = 0; i < found_.cells(); ++i) {
        if (covered_[i] == 0 || found_.seen.grid.vertex[i] < 0 || found_.seen.grid.support[i] > 0)
            continue;
        const Point live =
            found_.place_of(found_.cell_u(i), found_.cell_v(i), found_.seen.grid.disparity[i]);
        misfit.push_back(std::abs(live.z - covered_[i]));
    }
    return static_cast<double>(misfit.size()) >=
               JoiningTissue::kMinOverlap * static_cast<double>(found_.cells()) &&
           median(misfit) <= JoiningTissue::kMaxMisfit;
}

// Which of the template's pieces lies where each piece of the surface now is.
void TissueFinder::find_pieces() {
    constexpr size_t kMaxPieces = decisions::TemplatePieces::kMaxPieces;
    std::vector<std::array<size_t, kMaxPieces>> votes(kMaxPieces);
    const std::vector<uint8_t>& seen_piece = found_.seen.grid.piece;
    for (size_t i = 0; i < found_.cells(); ++i) {
        if (covered_[i] == 0 || found_.seen.grid.vertex[i] < 0) continue;
        const double depth =
            found_.place_of(found_.cell_u(i), found_.cell_v(i), found_.seen.grid.disparity[i]).z;
        if (std::abs(depth - covered_[i]) <= JoiningTissue::kSameDepth * depth)
            ++votes[seen_piece.empty() ? 0 : size_t{seen_piece[i]}][covering_[i]];
    }
    for (const auto& vote : votes) {
        const auto most = std::max_element(vote.begin(), vote.end());
        found_.piece_of_seen.push_back(
            *most >= JoiningTissue::kMinNew ? static_cast<int>(most - vote.begin()) : -1);
    }
}

// Cells with measured tissue and no surface, not closer to it than neighbours of the grid are.
void TissueFinder::find_candidates() {
    found_.is_new.assign(found_.cells(), 0);
    for (size_t i = 0; i < found_.cells(); ++i)
        found_.is_new[i] =
            found_.seen.grid.vertex[i] >= 0 && found_.piece(i) >= 0 &&
            found_.seen.grid.support[i] <= found_.seen.grid.spacing && covered_[i] == 0 &&
            found_.vertices->nearest(found_.cell_u(i), found_.cell_v(i),
                                     JoiningTissue::kNewVertexApart * found_.seen.grid.spacing) ==
                nullptr;
}

// Control points on a grid over the image, as a template has them, where there is new tissue and no
// control point is near.
void TissueFinder::place_nodes() {
    std::vector<PixelPoint> fresh, present;
    for (size_t i = 0; i < found_.cells(); ++i)
        if (found_.is_new[i] != 0)
            fresh.push_back({static_cast<int32_t>(i), found_.cell_u(i), found_.cell_v(i)});
    for (size_t i = 0; i < found_.node_at.size(); ++i)
        if (found_.node_at[i].z > JoiningTissue::kMinDepth)
            present.push_back({static_cast<int32_t>(i), found_.pixel_u(found_.node_at[i]),
                               found_.pixel_v(found_.node_at[i])});
    const PixelBuckets new_cells(fresh, found_.node_spacing), nodes(present, found_.node_spacing);
    const int across = std::max(
        2, static_cast<int>(std::lround((found_.seen.width - 1) / found_.node_spacing)) + 1);
    const int down = std::max(
        2, static_cast<int>(std::lround((found_.seen.height - 1) / found_.node_spacing)) + 1);
    for (int y = 0; y < down; ++y)
        for (int x = 0; x < across; ++x) {
            const double u = x * (found_.seen.width - 1.0) / (across - 1),
                         v = y * (found_.seen.height - 1.0) / (down - 1);
            const int seen_piece = grid_piece(found_.seen, u, v);
            const int piece =
                seen_piece < 0 ? -1 : found_.piece_of_seen[static_cast<size_t>(seen_piece)];
            if (piece < 0) continue;
            const auto of_node = [&](const PixelPoint& point) {
                return old_.piece_of_node(static_cast<size_t>(point.index)) == piece;
            };
            const auto of_cell = [&](const PixelPoint& point) {
                return found_.piece(static_cast<size_t>(point.index)) == piece;
            };
            double disparity = 0, support = 0;
            if (!grid_disparity(found_.seen, seen_piece, u, v, disparity, support) ||
                nodes.nearest(u, v, JoiningTissue::kNewNodeApart * found_.node_spacing, of_node) !=
                    nullptr ||
                new_cells.nearest(u, v, JoiningTissue::kNewNodeReach * found_.node_spacing,
                                  of_cell) == nullptr)
                continue;
            NewTissue::Node node{u,
                                 v,
                                 found_.place_of(u, v, disparity),
                                 {},
                                 Motion::identity(),
                                 Motion::identity(),
                                 static_cast<uint8_t>(piece)};
            node.anchor = anchor_of(node.place, piece);
            node.motion = follow_nearest_nodes(node.anchor, old_.nodes, now_.motions);
            node.earlier_motion = follow_nearest_nodes(node.anchor, old_.nodes, earlier_.motions);
            found_.nodes.push_back(node);
        }
}

// The anchor of a place on one of the template's pieces.
NearestNodes TissueFinder::anchor_of(const Point& place, int piece) const {
    std::vector<Point> nodes;
    std::vector<int32_t> index;
    for (size_t i = 0; i < found_.node_at.size(); ++i)
        if (old_.piece_of_node(i) == piece) {
            nodes.push_back(found_.node_at[i]);
            index.push_back(static_cast<int32_t>(i));
        }
    NearestNodes anchor = nearest_nodes_at(nodes, {}, old_.node_spacing_mm, place);
    for (int32_t& node : anchor.node) node = index[static_cast<size_t>(node)];
    return anchor;
}

const NewTissue::Node* TissueFinder::nearest_new_node(double u, double v, int piece) const {
    const NewTissue::Node* nearest = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const NewTissue::Node& node : found_.nodes) {
        const double squared = (node.u - u) * (node.u - u) + (node.v - v) * (node.v - v);
        if (squared >= least || node.piece != piece) continue;
        least = squared;
        nearest = &node;
    }
    return nearest;
}

// Whether the earlier frame shows a surface where the cell's tissue was then, if it moves with the
// tissue beside it.
bool TissueFinder::was_seen(size_t cell) const {
    const double u = found_.cell_u(cell), v = found_.cell_v(cell);
    const NewTissue::Node* node = nearest_new_node(u, v, found_.piece(cell));
    Motion now = Motion::identity(), then = now;
    if (node != nullptr) {
        now = node->motion;
        then = node->earlier_motion;
    } else {
        const NearestNodes anchor =
            anchor_of(found_.place_of(u, v, found_.seen.grid.disparity[cell]), found_.piece(cell));
        now = follow_nearest_nodes(anchor, old_.nodes, now_.motions);
        then = follow_nearest_nodes(anchor, old_.nodes, earlier_.motions);
    }
    const Point p =
        apply(compose(then, inverse(now)), found_.place_of(u, v, found_.seen.grid.disparity[cell]));
    if (!(p.z > JoiningTissue::kMinDepth)) return false;
    constexpr int kReach = JoiningTissue::kSeenReach;
    const long x = std::lround(found_.pixel_u(p)), y = std::lround(found_.pixel_v(p));
    const CaptureInput& images = earlier_.images;
    if (x < kReach || y < kReach || x + kReach >= static_cast<long>(images.width) ||
        y + kReach >= static_cast<long>(images.height))
        return false;
    const double at_one =
        double{DEFREC_DISPARITY_ONE} * images.camera.fx * images.camera.baseline_mm;
    const double offset = double{DEFREC_DISPARITY_ONE} * images.camera.disparity_offset_px;
    for (long dy = -kReach; dy <= kReach; ++dy)
        for (long dx = -kReach; dx <= kReach; ++dx) {
            const int16_t raw = images.disparity[static_cast<size_t>(y + dy) * images.width +
                                                 static_cast<size_t>(x + dx)];
            if (raw > 0 &&
                std::abs(at_one / (raw + offset) - p.z) <= JoiningTissue::kSameDepth * p.z)
                return true;
        }
    return false;
}

void TissueFinder::keep_what_was_seen() {
    for (size_t i = 0; i < found_.cells(); ++i)
        if (found_.is_new[i] != 0 && !was_seen(i)) found_.is_new[i] = 0;
}

// The cells that are connected to a seed and belong, the seed first. done: cells that were visited.
template <class Belongs>
std::vector<size_t> TissueFinder::connected(size_t seed, std::vector<uint8_t>& done,
                                            Belongs&& belongs) const {
    std::vector<size_t> piece{seed};
    done[seed] = 1;
    for (size_t next = 0; next < piece.size(); ++next) {
        const int x = static_cast<int>(piece[next] % found_.columns()),
                  y = static_cast<int>(piece[next] / found_.columns());
        for (const auto& [nx, ny] : {std::pair{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
            if (nx < 0 || ny < 0 || nx >= found_.seen.grid.columns || ny >= found_.seen.grid.rows)
                continue;
            const size_t other =
                static_cast<size_t>(ny) * found_.columns() + static_cast<size_t>(nx);
            if (done[other] != 0 || !belongs(other)) continue;
            if (found_.piece(other) != found_.piece(seed)) continue;
            done[other] = 1;
            piece.push_back(other);
        }
    }
    return piece;
}

// Keeps the connected pieces of new cells that are large enough and touch the surface.
void TissueFinder::keep_whole_pieces() {
    std::vector<uint8_t> done(found_.cells(), 0);
    const auto belongs = [&](size_t cell) { return found_.is_new[cell] == 1; };
    const auto touches = [&](size_t cell) {
        return found_.nearest_vertex(old_, cell,
                                     JoiningTissue::kTouch * found_.seen.grid.spacing) != nullptr;
    };
    for (size_t seed = 0; seed < found_.cells(); ++seed) {
        if (done[seed] != 0 || !belongs(seed)) continue;
        const std::vector<size_t> piece = connected(seed, done, belongs);
        if (piece.size() >= JoiningTissue::kMinNew &&
            std::any_of(piece.begin(), piece.end(), touches))
            continue;
        for (const size_t cell : piece) found_.is_new[cell] = 0;
    }
}

// Small places without depth amid tissue, as a first view's surface has none either.
void TissueFinder::fill_holes() {
    std::vector<uint8_t> done(found_.cells(), 0);
    const auto belongs = [&](size_t cell) {
        return found_.is_new[cell] == 0 && covered_[cell] == 0 &&
               found_.vertices->nearest(
                   found_.cell_u(cell), found_.cell_v(cell),
                   JoiningTissue::kNewVertexApart * found_.seen.grid.spacing) == nullptr;
    };
    const auto can_join = [&](size_t cell) {
        const size_t x = cell % found_.columns(), y = cell / found_.columns();
        return found_.seen.grid.vertex[cell] >= 0 && found_.piece(cell) >= 0 && x > 0 && y > 0 &&
               x + 1 < found_.columns() && y + 1 < static_cast<size_t>(found_.seen.grid.rows);
    };
    for (size_t seed = 0; seed < found_.cells(); ++seed) {
        if (done[seed] != 0 || !belongs(seed)) continue;
        const std::vector<size_t> hole = connected(seed, done, belongs);
        if (hole.size() > JoiningTissue::kMaxHole ||
            !std::all_of(hole.begin(), hole.end(), can_join))
            continue;
        for (const size_t cell : hole) found_.is_new[cell] = 1;
    }
}

}  // namespace

Search find_new_tissue(const TemplateData& data, const FoundFrame& earlier, const FoundFrame& now,
                       NewTissue& tissue) {
    return TissueFinder(data, earlier, now, tissue).find();
}

}  // namespace defrec
