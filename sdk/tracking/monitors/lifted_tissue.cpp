// See lifted_tissue.hpp.
#include "sdk/tracking/monitors/lifted_tissue.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/template/nearest_nodes.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"
#include "sdk/tracking/map/piece_search.hpp"
#include "sdk/tracking/monitors/lifted_region.hpp"

namespace defrec {
namespace {

using decisions::Lifted;

using Motion = DualQuaternion<double>;

// The control points of the first view's grid that lie in a region, by how it moved.
Tear tear_of(const TemplateData& data, LiftedRegion region) {
    Tear tear{std::move(region.tears), {}};
    std::vector<PointPair> pairs = agreeing_pairs(region.pairs, fit_pairs(region.pairs));
    pairs = agreeing_pairs(region.pairs, fit_pairs(pairs));
    if (2 * pairs.size() < region.pairs.size()) return {};
    const SurfaceGrid& grid = data.grid;
    const NodeGrid& nodes = data.node_grid;
    for (int row = 0; row < nodes.rows; ++row)
        for (int column = 0; column < nodes.columns; ++column) {
            const int32_t node = nodes.node[region.piece * nodes.cells() +
                                            static_cast<size_t>(row * nodes.columns + column)];
            if (node < 0) continue;
            const auto x = std::clamp(
                           static_cast<int>(std::lround(column * nodes.spacing_u / grid.spacing)),
                           0, grid.columns - 1),
                       y = std::clamp(
                           static_cast<int>(std::lround(row * nodes.spacing_v / grid.spacing)), 0,
                           grid.rows - 1);
            if (region.is_lifted[static_cast<size_t>(y * grid.columns + x)] == 0) continue;
            const auto i = static_cast<size_t>(node);
            tear.motions.emplace_back(i,
                                      fit_near(pairs, load3<double>(&data.nodes[3 * i])).store());
        }
    return tear;
}

// Where a control point is in the next frame, if it moves on as it did.
defrec_motion moved_on(const TemplateData& data, std::span<const PointPair> steps, size_t node,
                       const defrec_motion& now) {
    if (steps.size() < Lifted::kMinSteps) return now;
    const Motion motion = Motion::load(now);
    const Vec3<double> place = apply(motion, load3<double>(&data.nodes[3 * node]));
    return normalise(compose(fit_near(steps, place), motion)).store();
}

}  // namespace

void LiftedTissue::reset() {
    found_.reset();
    is_lifted_.clear();
    last_.clear();
    next_.clear();
    seen_.clear();
    frames_ = 0;
    was_seen_ = false;
}

void LiftedTissue::add_frame(const TemplateData& data, const FrameOutput& output,
                             std::span<const uint8_t> is_confirmed) {
    if (found_) return;
    if (any()) {
        ++frames_;
        follow(data, output, is_confirmed);
    }
    if (frames_ < Lifted::kGrowFrames) {
        positions_.resize(output.motions.size());
        for (size_t i = 0; i < positions_.size(); ++i)
            positions_[i] = node_position(data.nodes, output.motions, i);
        if (may_be_torn(data, positions_))
            look(data, output, is_confirmed);
        else if (!any())
            return seen_.clear();
    }
    remember(data, output, is_confirmed);
}

// Finds tissue that is to be parted; it moves on as it did since the frame before.
void LiftedTissue::look(const TemplateData& data, const FrameOutput& output,
                        std::span<const uint8_t> is_confirmed) {
    std::optional<LiftedRegion> region = find_lifted_region(data, output, is_confirmed);
    if (!region) return;
    Tear tear = tear_of(data, std::move(*region));
    if (tear.motions.empty()) return;
    std::vector<uint8_t> moves(output.motions.size(), 0);
    for (const auto& [node, motion] : tear.motions) moves[node] = 1;
    const std::vector<PointPair> steps = steps_of(data, output, is_confirmed, moves);
    for (auto& [node, motion] : tear.motions) motion = moved_on(data, steps, node, motion);
    found_ = std::move(tear);
}

// From where vertices were seen in the frame before to where they are seen; of those that the
// marked control points move most.
std::vector<PointPair> LiftedTissue::steps_of(const TemplateData& data, const FrameOutput& output,
                                              std::span<const uint8_t> is_confirmed,
                                              std::span<const uint8_t> moves) const {
    std::vector<PointPair> steps;
    for (size_t i = 0; i < std::min(data.vertices.size(), seen_.size()); ++i) {
        const defrec_surface_point& vertex = data.vertices[i];
        if (seen_[i].position[2] == 0 || is_confirmed[i] == 0 || !has_live_place(output.samples[i]))
            continue;
        float weight = 0;
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
            if (moves[static_cast<size_t>(vertex.node[k])] != 0) weight += vertex.weight[k];
        if (weight > 0.5f)
            steps.push_back(
                {live_place(seen_[i].position, seen_[i].residual), live_place(output.samples[i])});
    }
    if (steps.size() < Lifted::kMinSteps) return {};
    return agreeing_pairs(steps, fit_pairs(steps));
}

void LiftedTissue::remember(const TemplateData& data, const FrameOutput& output,
                            std::span<const uint8_t> is_confirmed) {
    seen_.resize(data.vertices.size());
    for (size_t i = 0; i < seen_.size(); ++i) {
        const defrec_surface_sample& sample = output.samples[i];
        const float* at = sample.position;
        seen_[i] = {{at[0], at[1], at[2]}, sample.residual};
        if (is_confirmed[i] == 0 || !has_live_place(sample)) seen_[i].position[2] = 0;
    }
}

void LiftedTissue::end_release() {
    for (const auto& [node, motion] : found_->motions) {
        if (node >= is_lifted_.size()) is_lifted_.resize(node + 1, 0);
        is_lifted_[node] = 1;
    }
    found_.reset();
}

void LiftedTissue::follow(const TemplateData& data, const FrameOutput& output,
                          std::span<const uint8_t> is_confirmed) {
    is_lifted_.resize(output.motions.size(), 0);
    was_seen_ = is_seen(data, output.samples, is_confirmed);
    if (!was_seen_) return hold(data, output);
    const std::vector<PointPair> steps = steps_of(data, output, is_confirmed, is_lifted_);
    last_.assign(output.motions.begin(), output.motions.end());
    next_ = last_;
    for (size_t i = 0; i < is_lifted_.size(); ++i)
        if (is_lifted_[i] != 0) next_[i] = moved_on(data, steps, i, last_[i]);
}

// It goes with what it hangs on, unless its own matches say where it is.
void LiftedTissue::hold(const TemplateData& data, const FrameOutput& output) {
    if (last_.size() != output.motions.size())
        last_.assign(output.motions.begin(), output.motions.end());
    std::vector<defrec_motion> searched(output.motions.begin(), output.motions.end());
    if (search_nodes(data, is_lifted_, output.matches, searched)) {
        next_ = searched;
        last_ = searched;
        return;
    }
    std::vector<PointPair> rest;
    for (size_t i = 0; i < is_lifted_.size(); ++i)
        if (is_lifted_[i] == 0)
            rest.push_back({node_position(data.nodes, last_, i),
                            node_position(data.nodes, output.motions, i)});
    for (size_t i = 0; i < is_lifted_.size(); ++i) {
        if (is_lifted_[i] == 0) {
            last_[i] = output.motions[i];
            continue;
        }
        const Motion held = Motion::load(last_[i]);
        last_[i] =
            normalise(compose(fit_near(rest, node_position(data.nodes, last_, i)), held)).store();
    }
    next_ = last_;
}

bool LiftedTissue::moves(const defrec_surface_point& point) const {
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
        const auto node = static_cast<size_t>(point.node[k]);
        if (point.weight[k] > 0 && node < is_lifted_.size() && is_lifted_[node] != 0) return true;
    }
    return false;
}

bool LiftedTissue::is_seen(const TemplateData& data, std::span<const defrec_surface_sample> samples,
                           std::span<const uint8_t> is_confirmed) const {
    double seen = 0, all = 0;
    for (size_t i = 0; i < data.vertices.size(); i += decisions::Departure::kStep) {
        if (data.check_of_vertex[i] < 0) continue;
        double weight = 0;
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
            const auto node = static_cast<size_t>(data.vertices[i].node[k]);
            if (node < is_lifted_.size() && is_lifted_[node] != 0)
                weight += double{data.vertices[i].weight[k]};
        }
        all += weight;
        if (is_confirmed[i] != 0 && samples[i].observation == DEFREC_OBSERVED) seen += weight;
    }
    return seen >= Lifted::kMinSeen * all;
}

void LiftedTissue::place(std::span<defrec_motion> motions) const {
    if (next_.size() != motions.size()) return;
    for (size_t i = 0; i < is_lifted_.size(); ++i)
        if (is_lifted_[i] != 0) motions[i] = next_[i];
}

}  // namespace defrec
