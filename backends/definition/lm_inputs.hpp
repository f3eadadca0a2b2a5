// What stage lm is given: the template that prepare reads and checks, and one frame's observations.
#pragma once
#include <vector>

#include "backends/shared/block_pattern.hpp"
#include "backends/stages/lm.hpp"

namespace defrec {

struct LmTemplate {
    HostVector<int32_t> given_node;  // of each control point: its number as given
    HostVector<Vec3<double>> nodes;
    HostVector<defrec_edge> edges;            // a < b, ascending, each pair once
    HostVector<Vec3<double>> rest_direction;  // of each edge, unit, from a to b
    HostVector<double> rest_length;           // mm
    HostVector<defrec_surface_point> points, landmarks;
    HostVector<defrec_patch> patches;
    BlockPattern pattern;
    double mean_degree = 1;  // mean over control points of the sum of their edges' weights

    explicit LmTemplate(const Host& host)
        : given_node(HostAllocator<int32_t>(host)),
          nodes(HostAllocator<Vec3<double>>(host)),
          edges(HostAllocator<defrec_edge>(host)),
          rest_direction(HostAllocator<Vec3<double>>(host)),
          rest_length(HostAllocator<double>(host)),
          points(HostAllocator<defrec_surface_point>(host)),
          landmarks(HostAllocator<defrec_surface_point>(host)),
          patches(HostAllocator<defrec_patch>(host)),
          pattern(host) {}

    // Throws where something cannot be used. only_used: leaves out control points that nothing
    // refers to; what refers to the others has their new numbers.
    void read(const defrec_lm_params& params, std::span<const InBuffer> in,
              bool only_used = false) {
        const LmTemplateBuffers given = read_template(params, in);
        edges.assign(given.edges, given.edges + params.edges);
        points.assign(given.points, given.points + params.points);
        landmarks.assign(given.landmarks, given.landmarks + params.landmarks);
        patches.assign(given.patches, given.patches + params.patches);
        take_nodes(given.nodes, params.nodes, only_used);
        take_edges(params.nodes);
        build_pattern();
    }

  private:
    // Calls visit with every number of a control point.
    template <class Function>
    void visit_nodes(const Function& visit) {
        for (defrec_edge& edge : edges) {
            visit(edge.a);
            visit(edge.b);
        }
        const auto visit_blend_weights = [&](auto& items) {
            for (auto& item : items)
                for (int32_t& node : item.node) visit(node);
        };
        visit_blend_weights(points);
        visit_blend_weights(landmarks);
        visit_blend_weights(patches);
    }

    void take_nodes(const float* given, size_t count, bool only_used) {
        std::vector<int32_t> number(count, only_used ? -1 : 0);
        visit_nodes([&](int32_t node) { number[size_t(node)] = 0; });
        given_node.clear();
        nodes.clear();
        for (size_t i = 0; i < count; ++i) {
            if (number[i] < 0) continue;
            number[i] = int32_t(nodes.size());
            given_node.push_back(int32_t(i));
            nodes.push_back(load3<double>(given + 3 * i));
        }
        visit_nodes([&](int32_t& node) { node = number[size_t(node)]; });
    }

    // all_nodes: as many as were given.
    void take_edges(size_t all_nodes) {
        for (defrec_edge& edge : edges)
            edge = {std::min(edge.a, edge.b), std::max(edge.a, edge.b), edge.weight};
        const auto before = [](const defrec_edge& x, const defrec_edge& y) {
            return std::pair(x.a, x.b) < std::pair(y.a, y.b);
        };
        std::stable_sort(edges.begin(), edges.end(), before);
        size_t kept = 0;
        for (const defrec_edge& edge : edges) {
            if (kept > 0 && !before(edges[kept - 1], edge))
                edges[kept - 1].weight += edge.weight;
            else
                edges[kept++] = edge;
        }
        edges.resize(kept);
        measure_edges(all_nodes);
    }

    void measure_edges(size_t all_nodes) {
        rest_direction.clear();
        rest_length.clear();
        double weights = 0;
        for (const defrec_edge& edge : edges) {
            const Vec3<double> along = nodes[size_t(edge.b)] - nodes[size_t(edge.a)];
            const double length = std::sqrt(dot(along, along));
            rest_direction.push_back((1 / length) * along);
            rest_length.push_back(length);
            weights += 2.0 * double(edge.weight);
        }
        mean_degree = weights > 0 ? weights / double(all_nodes) : 1;
    }

    void build_pattern() {
        pattern.begin(nodes.size());
        for (const defrec_edge& edge : edges) pattern.add(edge.a, edge.b);
        const auto add = [this](const auto& items) {
            for (const auto& item : items)
                for (int k = 1; k < DEFREC_BLEND_NODES; ++k)
                    for (int l = 0; l < k; ++l) pattern.add(item.node[k], item.node[l]);
        };
        add(points);
        add(landmarks);
        add(patches);
        pattern.finish();
    }
};

// One frame; pointers are nullptr where nothing was given.
struct LmFrame {
    const defrec_motion* motions;
    const defrec_match* matches;
    const defrec_patch_observation* observations;
    DisparityImage disparity;
};

inline LmFrame frame_of(const defrec_lm_params& params, const LmBuffers& given) {
    return {given.motions, given.matches, given.observations,
            disparity_image(params, given.disparity)};
}

// A match that says where its landmark is now. In single precision for every backend: whether a
// direction is finite must not depend on it.
constexpr bool has_depth(const defrec_match& match) {
    const float* p = match.position;
    return p[2] > 0 && all_finite(p, 3) && std::isfinite(p[0] / p[2]) &&
           std::isfinite(p[1] / p[2]) && std::isfinite(match.weight);
}
constexpr bool preselected(const defrec_match& match) {
    return has_depth(match) && match.weight > 0;
}

}  // namespace defrec
