// The template of stage lm as devices read it: in single precision, what each item and each edge
// needs side by side.
#pragma once
#include <array>
#include <vector>

#include "backends/definition/lm_inputs.hpp"

namespace defrec {

using Vector4 = std::array<float, 4>;

struct LmEdge {
    Vector4 rest;  // direction from a to b, and length
    uint32_t a, b;
    float share;  // of the data's weight that S is
    uint32_t unused = 0;
};

struct LmLists {
    // Vectors of an item, a point, landmark or patch: position, normal, then for each of its
    // control points what leads from it to the item, and the weight.
    static constexpr size_t kItemVectors = 6, kItemArms = 2;

    std::vector<Vector4> rest;   // control points
    std::vector<Vector4> items;  // points, landmarks, patches; kItemVectors each
    std::vector<std::array<int32_t, DEFREC_BLEND_NODES>> item_nodes;
    std::vector<LmEdge> edges;

    LmLists(const defrec_lm_params& params, const LmTemplate& surface) {
        for (const Vec3<double>& node : surface.nodes) rest.push_back(vector(node, 0));
        add_items<defrec_surface_point>(surface, surface.points,
                                        [](const defrec_surface_point& p) { return &p.normal[0]; });
        add_items<defrec_surface_point>(surface, surface.landmarks, nullptr);
        add_items<defrec_patch>(surface, surface.patches, nullptr);
        const double share = kArapShare * double(params.arap_weight) / surface.mean_degree;
        for (size_t i = 0; i < surface.edges.size(); ++i) {
            const defrec_edge& edge = surface.edges[i];
            edges.push_back({vector(surface.rest_direction[i], surface.rest_length[i]),
                             uint32_t(edge.a), uint32_t(edge.b),
                             float(share * double(edge.weight))});
        }
    }

    float weight(size_t item, size_t k) const {
        return items[kItemVectors * item + kItemArms + k][3];
    }

  private:
    static Vector4 vector(Vec3<double> v, double w) {
        return {float(v.x), float(v.y), float(v.z), float(w)};
    }

    template <class Item>
    void add_items(const LmTemplate& surface, const HostVector<Item>& given,
                   const float* (*normal)(const Item&)) {
        for (const Item& item : given) {
            const Vec3<double> position = load3<double>(item.position);
            items.push_back(vector(position, 0));
            items.push_back(normal != nullptr ? vector(load3<double>(normal(item)), 0) : Vector4{});
            auto& nodes = item_nodes.emplace_back();
            for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
                nodes[k] = item.node[k];
                items.push_back(
                    vector(position - surface.nodes[size_t(item.node[k])], double(item.weight[k])));
            }
        }
    }
};

}  // namespace defrec
