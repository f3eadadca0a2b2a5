// See growth.hpp.
#include "sdk/template/growth.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "backends/shared/motion.hpp"
#include "sdk/base/util/median.hpp"
#include "sdk/contract/stage_params.hpp"
#include "sdk/template/atlas.hpp"
#include "sdk/template/check_patches.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/template/grid_distance.hpp"
#include "sdk/template/new_tissue.hpp"
#include "sdk/template/node_edges.hpp"
#include "sdk/template/patch_places.hpp"
#include "sdk/template/scattered_blend_weights.hpp"
#include "sdk/template/surface_point.hpp"

namespace defrec {
namespace {

using Motion = DualQuaternion<double>;
using Point = Vec3<double>;
using decisions::AtlasLimits;
using decisions::JoiningTissue;
using decisions::PatchPlaces;

Point as_point(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// Builds one grown template.
class Grower {
  public:
    Grower(const TemplateData& data, const FoundFrame& earlier, const FoundFrame& now)
        : old_(data), earlier_(earlier), now_(now) {}

    Growth grow(size_t max_vertices);

  private:
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

    const TemplateData& old_;
    const FoundFrame &earlier_, &now_;
    NewTissue tissue_;                 // of the frame now
    std::vector<PixelBuckets> nodes_;  // old and new ones, in the image, piece by piece
    std::vector<Motion> motions_;      // of all control points
    SurfacePatch part_;                // over the whole image until it is cropped
};

void Grower::append_nodes(Growth& growth) {
    TemplateData& data = growth.data;
    std::vector<PixelPoint> fresh;
    std::vector<std::vector<PixelPoint>> all(old_.pieces());
    for (size_t i = 0; i < tissue_.cells(); ++i)
        if (tissue_.is_new[i] != 0)
            fresh.push_back({static_cast<int32_t>(i), tissue_.cell_u(i), tissue_.cell_v(i)});
    const PixelBuckets new_cells(fresh, tissue_.node_spacing);
    for (const defrec_motion& motion : now_.motions) motions_.push_back(Motion::load(motion));
    for (size_t i = 0; i < tissue_.node_at.size(); ++i)
        if (tissue_.node_at[i].z > JoiningTissue::kMinDepth)
            all[old_.piece_of_node(i)].push_back({static_cast<int32_t>(i),
                                                  tissue_.pixel_u(tissue_.node_at[i]),
                                                  tissue_.pixel_v(tissue_.node_at[i])});
    for (const NewTissue::Node& node : tissue_.nodes) {
        const auto of_piece = [&](const PixelPoint& point) {
            return tissue_.piece(static_cast<size_t>(point.index)) == node.piece;
        };
        if (new_cells.nearest(node.u, node.v, JoiningTissue::kNewNodeReach * tissue_.node_spacing,
                              of_piece) == nullptr)
            continue;
        if (!data.node_piece.empty()) data.node_piece.push_back(node.piece);
        all[node.piece].push_back({static_cast<int32_t>(motions_.size()), node.u, node.v});
        motions_.push_back(node.motion);
        growth.anchors.push_back(node.anchor);
        const Point rest = apply(inverse(node.motion), node.place);
        for (const double value : {rest.x, rest.y, rest.z})
            data.nodes.push_back(static_cast<float>(value));
    }
    for (const std::vector<PixelPoint>& nodes : all)
        nodes_.emplace_back(nodes, tissue_.node_spacing);
    connect_nodes(data, tissue_.node_at.size());
}

// The surface under a pixel carried back to the template frame.
bool Grower::carry(double u, double v, defrec_surface_point& point, SurfacePlace& place,
                   Motion& motion) const {
    BlendWeights blend_weights;
    const int seen_piece = grid_piece(tissue_.seen, u, v);
    const int piece = seen_piece < 0 ? -1 : tissue_.piece_of_seen[static_cast<size_t>(seen_piece)];
    if (piece < 0 || !surface_place(tissue_.seen, u, v, place) ||
        !scattered_blend_weights(nodes_[static_cast<size_t>(piece)], tissue_.node_spacing, u, v,
                                 blend_weights))
        return false;
    motion = blend<double>(motions_.data(), blend_weights.node.data(), blend_weights.weight.data());
    store3(apply(inverse(motion), as_point(place.position)), point.position);
    store3(rotate(conjugate(motion.real), as_point(place.normal)), point.normal);
    std::copy(blend_weights.node.begin(), blend_weights.node.end(), point.node);
    std::copy(blend_weights.weight.begin(), blend_weights.weight.end(), point.weight);
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
    part_.columns = tissue_.seen.grid.columns;
    part_.rows = tissue_.seen.grid.rows;
    part_.min_disparity = std::numeric_limits<float>::max();
    part_.vertex.assign(tissue_.cells(), -1);
    std::vector<double> steps;
    for (size_t i = 0; i < tissue_.cells(); ++i) {
        if (tissue_.seen.grid.vertex[i] >= 0 && tissue_.seen.grid.support[i] <= 0) {
            part_.min_disparity = std::min(part_.min_disparity, tissue_.seen.grid.disparity[i]);
            part_.max_disparity = std::max(part_.max_disparity, tissue_.seen.grid.disparity[i]);
        }
        defrec_surface_point point{};
        if (tissue_.is_new[i] == 0 || !carry_point(tissue_.cell_u(i), tissue_.cell_v(i), point)) {
            tissue_.is_new[i] = 0;
            continue;
        }
        part_.vertex[i] = static_cast<int32_t>(data.vertices.size());
        data.vertices.push_back(point);
        // What counts is the distance on the tissue, for which it is multiplied by the depth at
        // rest.
        const double depth = tissue_.place_of(0, 0, tissue_.seen.grid.disparity[i]).z;
        data.vertex_support.push_back(static_cast<float>(tissue_.seen.grid.support[i] * depth /
                                                         std::max(1.f, point.position[2])));
        steps.push_back(tissue_.seen.grid.spacing * depth / old_.camera.fx);
    }
    if (!steps.empty()) part_.step_mm = static_cast<float>(median(steps));
}

// Between new vertices, and from them to the nearest vertices of the surface that they join.
void Grower::append_triangles(TemplateData& data) {
    const double spacing = tissue_.seen.grid.spacing;
    for (size_t i = 0; i < tissue_.cells(); ++i)
        if (part_.vertex[i] < 0)
            if (const PixelPoint* near =
                    tissue_.nearest_vertex(old_, i, JoiningTissue::kTouch * spacing))
                part_.vertex[i] = near->index;
    const auto first_new = static_cast<int32_t>(part_.before.vertices);
    const auto pixel = [&](size_t cell) {
        const int32_t vertex = part_.vertex[cell];
        if (vertex >= first_new) return std::pair{tissue_.cell_u(cell), tissue_.cell_v(cell)};
        const Point& p = tissue_.vertex_at[static_cast<size_t>(vertex)];
        return std::pair{tissue_.pixel_u(p), tissue_.pixel_v(p)};
    };
    // Adds the triangle of three cells; false where they make none.
    const auto add = [&](size_t a, size_t b, size_t c) {
        const int32_t i = part_.vertex[a], j = part_.vertex[b], k = part_.vertex[c];
        if (i < 0 || j < 0 || k < 0 || std::max({i, j, k}) < first_new) return false;
        const auto piece = [&](int32_t vertex) {
            return data.piece_of(data.vertices[static_cast<size_t>(vertex)]);
        };
        if (piece(i) != piece(j) || piece(j) != piece(k)) return false;
        const auto [ua, va] = pixel(a);
        const auto [ub, vb] = pixel(b);
        const auto [uc, vc] = pixel(c);
        // Counter-clockwise seen from the camera: clockwise where v points down, as here it does.
        const double area = (ub - ua) * (vc - va) - (uc - ua) * (vb - va);
        if (i == j || j == k || i == k || area > -JoiningTissue::kMinTriangle * spacing * spacing)
            return false;
        for (const int32_t index : {i, j, k})
            data.triangles.push_back(static_cast<uint32_t>(index));
        return true;
    };
    for (int y = 0; y + 1 < tissue_.seen.grid.rows; ++y)
        for (int x = 0; x + 1 < tissue_.seen.grid.columns; ++x) {
            const size_t a = static_cast<size_t>(y) * tissue_.columns() + static_cast<size_t>(x),
                         b = a + 1, c = a + tissue_.columns(), d = c + 1;
            const bool upper = add(a, c, b), lower = add(b, c, d);
            if (upper || lower) continue;
            // One corner may be missing.
            if (!add(a, d, b)) add(a, c, d);
        }
}

// Leaves of the grid what is new and its nearest_surface. The offset stays even, so that every
// second cell is the same before and after.
void Grower::crop_part(TemplateData& data) {
    int x0 = part_.columns, y0 = part_.rows, x1 = 0, y1 = 0;
    for (int y = 0; y < part_.rows; ++y)
        for (int x = 0; x < part_.columns; ++x)
            if (tissue_.is_new[static_cast<size_t>(y) * tissue_.columns() +
                               static_cast<size_t>(x)] != 0) {
                x0 = std::min(x0, x);
                y0 = std::min(y0, y);
                x1 = std::max(x1, x + 1);
                y1 = std::max(y1, y + 1);
            }
    x0 = std::max(0, x0 - JoiningTissue::kGridMargin) / 2 * 2;
    y0 = std::max(0, y0 - JoiningTissue::kGridMargin) / 2 * 2;
    x1 = std::min(part_.columns, x1 + JoiningTissue::kGridMargin);
    y1 = std::min(part_.rows, y1 + JoiningTissue::kGridMargin);
    SurfacePatch& part = data.parts.emplace_back(part_);
    part.columns = x1 - x0;
    part.rows = y1 - y0;
    part.vertex.clear();
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x)
            part.vertex.push_back(
                part_.vertex[static_cast<size_t>(y) * tissue_.columns() + static_cast<size_t>(x)]);
}

// As many as stage match takes; what joins beyond them is followed by its patches and depth.
void Grower::append_landmarks(TemplateData& data) {
    for (const defrec_feature& feature : now_.images.features) {
        if (data.landmarks.size() >= size_t{kMatchMaxLandmarks}) return;
        const double u = feature.x / 16.0, v = feature.y / 16.0;
        double disparity = 0, support = 0;
        defrec_surface_point point{};
        if (tissue_.is_new[tissue_.cell_at(u, v)] == 0 ||
            !grid_disparity(tissue_.seen, u, v, disparity, support) ||
            support > tissue_.seen.grid.spacing || !carry_point(u, v, point))
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
        return tissue_.is_new[tissue_.cell_at(u, v)] != 0 &&
               grid_disparity(tissue_.seen, u, v, disparity, support) &&
               support <= tissue_.seen.grid.spacing;
    };
    for (const PatchPlace place : trackable_places(
             now_.images,
             std::max(PatchPlaces::kMinPatchCell, tissue_.scale * patch_cell(now_.images)),
             PatchPlaces::kPageBorder, has_new_surface)) {
        defrec_patch patch{};
        if (carry_patch(place.u, place.v, patch)) data.patches.push_back(patch);
    }
    append_checks(data, data.checks);
    std::vector<defrec_patch*> taken;
    for (size_t i = first_patch; i < data.patches.size(); ++i) taken.push_back(&data.patches[i]);
    for (size_t i = first_check; i < data.checks.size(); ++i) taken.push_back(&data.checks[i]);
    return store_pieces(data, taken, {0, 0, tissue_.seen.width, tissue_.seen.height});
}

// As place_checks does for the first view; also for the rim of the surface that was there, which
// had no whole window in its own view.
void Grower::append_checks(TemplateData& data, std::vector<defrec_patch>& checks) {
    const double window = (2 * decisions::CheckPatches::kCheckRadius + 1)
                          << check_level(tissue_.seen);
    const int step = std::max(1, static_cast<int>(window / tissue_.seen.grid.spacing));
    data.check_of_vertex.resize(data.vertices.size(), -1);
    std::vector<float> distance(tissue_.cells());
    for (size_t i = 0; i < tissue_.cells(); ++i) distance[i] = tissue_.is_new[i] != 0 ? 0.f : 1e9f;
    spread_distance(distance, tissue_.seen.grid.columns, tissue_.seen.grid.rows);
    for (int y0 = 0; y0 < tissue_.seen.grid.rows; y0 += step)
        for (int x0 = 0; x0 < tissue_.seen.grid.columns; x0 += step) {
            std::vector<size_t> within;  // vertices without a check
            for (int y = y0; y < std::min(y0 + step, tissue_.seen.grid.rows); ++y)
                for (int x = x0; x < std::min(x0 + step, tissue_.seen.grid.columns); ++x) {
                    const size_t cell =
                        static_cast<size_t>(y) * tissue_.columns() + static_cast<size_t>(x);
                    if (const int32_t vertex = part_.vertex[cell];
                        vertex >= 0 &&
                        distance[cell] <= static_cast<float>(JoiningTissue::kCheckReach * step) &&
                        data.check_of_vertex[static_cast<size_t>(vertex)] < 0)
                        within.push_back(static_cast<size_t>(vertex));
                }
            const double u = (x0 + 0.5 * (step - 1)) * tissue_.seen.grid.spacing,
                         v = (y0 + 0.5 * (step - 1)) * tissue_.seen.grid.spacing;
            defrec_patch check{};
            if (within.empty() || !has_check_texture(tissue_.seen, now_.images.gray, u, v) ||
                !carry_patch(u, v, check))
                continue;
            for (const size_t vertex : within)
                if (data.piece_of(data.vertices[vertex]) == data.piece_of(check))
                    data.check_of_vertex[vertex] = static_cast<int32_t>(checks.size());
            checks.push_back(check);
        }
}

// Copies the image round the patches to the atlas, in pieces of which they fill a good part. box:
// in which they lie.
bool Grower::store_pieces(TemplateData& data, std::span<defrec_patch*> patches,
                          const PixelBox& box) {
    if (patches.empty()) return true;
    constexpr double kPatchReach = AtlasLimits::kPatchReach;
    double u0 = box.x1, v0 = box.y1, u1 = box.x0, v1 = box.y0;
    for (const defrec_patch* patch : patches) {
        u0 = std::min<double>(u0, patch->u);
        v0 = std::min<double>(v0, patch->v);
        u1 = std::max<double>(u1, patch->u);
        v1 = std::max<double>(v1, patch->v);
    }
    const double across = u1 - u0, down = v1 - v0;
    // Where patches lie as densely as they do in a filled piece, the piece is worth its place.
    const double cell =
        std::max(PatchPlaces::kMinPatchCell, tissue_.scale * patch_cell(now_.images));
    const double filled = static_cast<double>(patches.size()) * cell * cell;
    if (across * down > AtlasLimits::kMaxUnfilled * filled &&
        std::max(across, down) > AtlasLimits::kMinHalved * kPatchReach) {
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
    const std::optional<AtlasPlace> place = add_to_atlas(data, now_.images.gray, piece);
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
    switch (find_new_tissue(old_, earlier_, now_, tissue_)) {
        case Search::kNothing:
            return growth;
        case Search::kUnfit:
            return end(Growth::Outcome::kUnfit);
        case Search::kFound:
            break;
    }
    if (old_.vertices.size() + tissue_.count() > max_vertices) return end(Growth::Outcome::kFull);
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
    Growth growth = Grower(data, earlier, now).grow(max_vertices);
    growth.data.disparity_sigma_px =
        std::max({data.disparity_sigma_px, earlier.images.disparity_sigma_px,
                  now.images.disparity_sigma_px});
    return growth;
}

void extend_motions(const std::vector<float>& nodes, std::span<const NearestNodes> anchors,
                    std::vector<defrec_motion>& motions) {
    for (const NearestNodes& anchor : anchors)
        motions.push_back(follow_nearest_nodes(anchor, nodes, motions).store());
}

}  // namespace defrec
