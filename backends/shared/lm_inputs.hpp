// What stage lm is given: the template that prepare reads and checks, and one frame's observations.
#pragma once
#include "backends/shared/block_pattern.hpp"
#include "backends/shared/live_depth.hpp"
#include "backends/shared/lm_arap.hpp"
#include "backends/shared/surface_checks.hpp"

namespace defrec {

struct LmTemplate {
    HostVector<Vec3<double>> nodes;
    HostVector<defrec_edge> edges;            // a < b, ascending, each pair once
    HostVector<Vec3<double>> rest_direction;  // of each edge, unit, from a to b
    HostVector<double> rest_length;           // mm
    HostVector<defrec_surface_point> points, landmarks;
    HostVector<defrec_patch> patches;
    BlockPattern pattern;
    double mean_degree = 1;  // mean over control points of the sum of their edges' weights

    explicit LmTemplate(const Host& host)
        : nodes(HostAllocator<Vec3<double>>(host)),
          edges(HostAllocator<defrec_edge>(host)),
          rest_direction(HostAllocator<Vec3<double>>(host)),
          rest_length(HostAllocator<double>(host)),
          points(HostAllocator<defrec_surface_point>(host)),
          landmarks(HostAllocator<defrec_surface_point>(host)),
          patches(HostAllocator<defrec_patch>(host)),
          pattern(host) {}

    // Throws where something cannot be used: an index out of range, a number that is not finite, an
    // edge of length 0.
    void read(const defrec_lm_params& params, std::span<const InBuffer> in) {
        expect_buffers("lm prepare", in, 5);
        const float* xyz = take<float>("lm control points", in[0], size_t(params.nodes) * 3);
        const auto* given_edges = take<defrec_edge>("lm edges", in[1], params.edges);
        const auto* given_points = take<defrec_surface_point>("lm points", in[2], params.points);
        const auto* given_landmarks =
            take<defrec_surface_point>("lm landmarks", in[3], params.landmarks);
        const auto* given_patches = take<defrec_patch>("lm patches", in[4], params.patches);
        if (!all_finite(xyz, size_t(params.nodes) * 3))
            throw StageError(DEFREC_ERROR_ARGUMENT, "lm: a control point's position is not finite");
        check_skinned("lm: point", given_points, params.points, params.nodes);
        check_skinned("lm: landmark", given_landmarks, params.landmarks, params.nodes);
        check_skinned("lm: patch", given_patches, params.patches, params.nodes);
        for (size_t i = 0; i < params.points; ++i)
            if (!all_finite(given_points[i].normal, 3))
                throw StageError(DEFREC_ERROR_ARGUMENT,
                                 "lm: the normal of point " + std::to_string(i) + " is not finite");

        nodes.clear();
        for (size_t i = 0; i < params.nodes; ++i) nodes.push_back(load3<double>(xyz + 3 * i));
        take_edges(given_edges, params.edges);
        points.assign(given_points, given_points + params.points);
        landmarks.assign(given_landmarks, given_landmarks + params.landmarks);
        patches.assign(given_patches, given_patches + params.patches);
        build_pattern();
    }

  private:
    void take_edges(const defrec_edge* given, size_t count) {
        edges.clear();
        for (size_t i = 0; i < count; ++i) {
            const defrec_edge& edge = given[i];
            const auto last = int64_t(nodes.size());
            const bool known = edge.a >= 0 && edge.b >= 0 && edge.a < last && edge.b < last;
            const Vec3<double> along =
                known ? nodes[size_t(edge.b)] - nodes[size_t(edge.a)] : Vec3<double>{};
            if (!(dot(along, along) > kMinLengthMm * kMinLengthMm) || !(edge.weight > 0) ||
                !std::isfinite(edge.weight))
                throw StageError(DEFREC_ERROR_ARGUMENT,
                                 "lm: edge " + std::to_string(i) +
                                     " has no length, no weight, or a control point outside 0.." +
                                     std::to_string(last) + " (exclusive)");
            edges.push_back({std::min(edge.a, edge.b), std::max(edge.a, edge.b), edge.weight});
        }
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
        measure_edges();
    }

    void measure_edges() {
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
        mean_degree = weights > 0 ? weights / double(nodes.size()) : 1;
    }

    void build_pattern() {
        pattern.begin(nodes.size());
        for (const defrec_edge& edge : edges) pattern.add(edge.a, edge.b);
        const auto add = [this](const auto& items) {
            for (const auto& item : items)
                for (int k = 1; k < DEFREC_SKIN_NODES; ++k)
                    for (int l = 0; l < k; ++l) pattern.add(item.node[k], item.node[l]);
        };
        add(points);
        add(landmarks);
        add(patches);
        pattern.finish();
    }
};

// The parameters of the cost as the terms take them, in single precision.
struct LmConstants {
    float icp_weight, match_weight, patch_weight;
    float icp_tukey, match_tukey, patch_tukey;  // mm, mm, px
    float association, match_slope;             // mm; 1 / (5 H)
    float length_weight, angle_weight,
        rotation_weight;  // the last two times the squared node spacing
    float spacing2, damping;

    explicit LmConstants(const defrec_lm_params& params)
        : icp_weight(params.icp_weight),
          match_weight(params.match_weight),
          patch_weight(params.patch_weight),
          icp_tukey(params.icp_tukey_mm),
          match_tukey(params.match_tukey_mm),
          patch_tukey(params.patch_tukey_px),
          association(params.association_mm),
          match_slope(1 / (5 * params.match_threshold_mm)),
          length_weight(params.length_weight),
          angle_weight(params.angle_weight * (params.node_spacing_mm * params.node_spacing_mm)),
          rotation_weight(params.rotation_weight *
                          (params.node_spacing_mm * params.node_spacing_mm)),
          spacing2(params.node_spacing_mm * params.node_spacing_mm),
          damping(params.damping) {}
};

// One frame; pointers are nullptr where nothing was given.
struct LmFrame {
    const defrec_motion* motions;
    const defrec_match* matches;
    const defrec_patch_observation* observations;
    DisparityImage disparity;

    static LmFrame read(const defrec_lm_params& params, std::span<const InBuffer> in) {
        expect_buffers("lm in", in, 1, 3);
        return {
            take<defrec_motion>("lm motions", in[0], params.nodes),
            take_optional<defrec_match>("lm matches", in, 1, params.landmarks),
            take_optional<defrec_patch_observation>("lm patch observations", in, 2, params.patches),
            take_disparity("lm disparity", params, in, 3)};
    }
};

// A match that says where its landmark is now.
constexpr bool has_depth(const defrec_match& match) {
    return match.position[2] > 0 && all_finite(match.position, 3) && std::isfinite(match.weight);
}
constexpr bool preselected(const defrec_match& match) {
    return has_depth(match) && match.weight > 0;
}

}  // namespace defrec
