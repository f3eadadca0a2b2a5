// See departed_tissue.hpp.
#include "sdk/tracking/monitors/departed_tissue.hpp"

#include <algorithm>

#include "sdk/tracking/decisions/template_changes.hpp"
#include "sdk/tracking/evidence/photometric_evidence.hpp"

namespace defrec {
namespace {

using decisions::Departure;

// How many control points each one is connected with that are marked, itself included.
std::vector<uint32_t> count_neighbours(const TemplateData& data,
                                       const std::vector<uint8_t>& is_marked) {
    std::vector<uint32_t> count(is_marked.begin(), is_marked.end());
    for (const defrec_edge& edge : data.edges) {
        const auto a = static_cast<size_t>(edge.a), b = static_cast<size_t>(edge.b);
        count[a] += is_marked[b];
        count[b] += is_marked[a];
    }
    return count;
}

// Whether the vertex's own tissue is seen, at another depth than the surface's.
bool is_seen_elsewhere(const TemplateData& data, const FrameOutput& output,
                       std::span<const uint8_t> is_confirmed, size_t vertex) {
    const defrec_surface_sample& sample = output.samples[vertex];
    return is_confirmed[vertex] != 0 && sample.observation != DEFREC_OBSERVED &&
           sample.observation != DEFREC_OUTSIDE && lies_elsewhere(data.camera, sample);
}

bool any_elsewhere(const TemplateData& data, const FrameOutput& output,
                   std::span<const uint8_t> is_confirmed) {
    for (size_t i = 0; i < data.vertices.size(); i += Departure::kStep)
        if (is_seen_elsewhere(data, output, is_confirmed, i)) return true;
    return false;
}

}  // namespace

bool DepartedTissue::Node::shows(float part) const {
    return weight > Departure::kMinWeight && part >= Departure::kMostOf * weight;
}

void DepartedTissue::reset() {
    for (std::vector<uint8_t>* of_nodes : {&was_seen_, &elsewhere_, &seen_again_})
        of_nodes->clear();
    ages_.clear();
    frames_ = 0;
    any_ = false;
    share_ = 0;
}

void DepartedTissue::add_frame(const TemplateData& data, const FrameOutput& output,
                               std::span<const uint8_t> is_confirmed, const LiftedNodes& lifted) {
    const size_t count = data.nodes.size() / 3;
    for (std::vector<uint8_t>* of_nodes : {&was_seen_, &elsewhere_, &seen_again_})
        of_nodes->resize(count, 0);
    ages_.resize(count, 0);
    if (frames_++ % Departure::kSeenEvery != 0 && !any_ && lifted.is_lifted.empty() &&
        !any_elsewhere(data, output, is_confirmed)) {
        std::fill(elsewhere_.begin(), elsewhere_.end(), uint8_t{0});
        return;
    }
    weigh(data, output, is_confirmed);
    find_leaving(data);
    set_lifted(lifted);
    if (!any_) return;
    spread(data);
    for (size_t i = 0; i < count; ++i) {
        if (ages_[i] == 0) continue;
        seen_again_[i] = nodes_[i].shows(nodes_[i].seen) ? seen_again_[i] + 1 : 0;
        ages_[i] = seen_again_[i] < Departure::kFramesBack ? ages_[i] + 1 : 0;
    }
    any_ = std::any_of(ages_.begin(), ages_.end(), [](uint32_t age) { return age > 0; });
    count_vertices(data, output);
}

void DepartedTissue::weigh(const TemplateData& data, const FrameOutput& output,
                           std::span<const uint8_t> is_confirmed) {
    nodes_.assign(data.nodes.size() / 3, {});
    for (size_t i = 0; i < data.vertices.size(); i += Departure::kStep) {
        const uint32_t observation = output.samples[i].observation;
        if (observation == DEFREC_OUTSIDE || data.check_of_vertex[i] < 0) continue;
        const bool is_seen = is_confirmed[i] != 0 && observation == DEFREC_OBSERVED,
                   is_elsewhere = is_seen_elsewhere(data, output, is_confirmed, i);
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
            Node& node = nodes_[static_cast<size_t>(data.vertices[i].node[k])];
            const float weight = data.vertices[i].weight[k];
            node.weight += weight;
            node.seen += is_seen ? weight : 0;
            node.elsewhere += is_elsewhere ? weight : 0;
        }
    }
}

// Several control points beside each other whose tissue is seen at another depth: a single one is
// what an instrument's edge gives. Where most of the surface is, depth is wrong.
void DepartedTissue::find_leaving(const TemplateData& data) {
    size_t seen = 0, elsewhere = 0;
    is_leaving_.resize(nodes_.size());
    for (size_t i = 0; i < nodes_.size(); ++i) {
        is_leaving_[i] = was_seen_[i] != 0 && nodes_[i].shows(nodes_[i].elsewhere);
        elsewhere_[i] = is_leaving_[i] != 0 ? std::min(elsewhere_[i] + 1, 255) : 0;
        const bool is_seen = nodes_[i].shows(nodes_[i].seen);
        was_seen_[i] |= is_seen ? 1 : 0;
        seen += is_seen ? 1 : 0;
        elsewhere += is_leaving_[i];
    }
    if (elsewhere < Departure::kMinNodes || elsewhere > seen) return;
    const std::vector<uint32_t> neighbours = count_neighbours(data, is_leaving_);
    for (size_t i = 0; i < nodes_.size(); ++i)
        if (elsewhere_[i] >= Departure::kFrames && neighbours[i] >= Departure::kMinNodes) {
            ages_[i] = std::max(ages_[i], 1u);
            any_ = true;
        }
}

// What was parted is followed as a whole: it is gone, or all of it is there.
void DepartedTissue::set_lifted(const LiftedNodes& lifted) {
    for (size_t i = 0; i < std::min(lifted.is_lifted.size(), ages_.size()); ++i) {
        if (lifted.is_lifted[i] == 0) continue;
        ages_[i] = lifted.are_seen ? 0 : std::max(ages_[i], 1u);
        any_ |= !lifted.are_seen;
    }
}

// What is expected beside tissue that is gone, and not seen, went with it.
void DepartedTissue::spread(const TemplateData& data) {
    const auto goes = [&](size_t node) {
        return ages_[node] == 0 && nodes_[node].weight > Departure::kMinWeight &&
               nodes_[node].seen < Departure::kFewOf * nodes_[node].weight;
    };
    for (bool changed = true; changed;) {
        changed = false;
        for (const defrec_edge& edge : data.edges) {
            const auto a = static_cast<size_t>(edge.a), b = static_cast<size_t>(edge.b);
            for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)})
                if (ages_[from] > 0 && goes(to)) {
                    ages_[to] = 1;
                    changed = true;
                }
        }
    }
}

uint32_t DepartedTissue::age_of(const defrec_surface_point& point) const {
    int most = 0;
    for (int k = 1; k < DEFREC_BLEND_NODES; ++k)
        if (point.weight[k] > point.weight[most]) most = k;
    const auto node = static_cast<size_t>(point.node[most]);
    return node < ages_.size() ? ages_[node] : 0;
}

void DepartedTissue::count_vertices(const TemplateData& data, const FrameOutput& output) {
    size_t inside = 0, left = 0;
    for (size_t i = 0; i < data.vertices.size(); i += Departure::kStep) {
        if (output.samples[i].observation == DEFREC_OUTSIDE) continue;
        ++inside;
        left += any_ && age_of(data.vertices[i]) > 0 ? 1 : 0;
    }
    share_ = static_cast<double>(left) / static_cast<double>(std::max<size_t>(1, inside));
}

}  // namespace defrec
