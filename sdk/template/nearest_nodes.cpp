// See nearest_nodes.hpp.
#include "sdk/template/nearest_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "backends/shared/rigid_fit.hpp"
#include "sdk/template/decisions.hpp"

namespace defrec {

NearestNodes nearest_nodes_at(std::span<const Vec3<double>> nodes, std::span<const uint8_t> piece,
                              double spacing_mm, const Vec3<double>& place) {
    std::vector<std::pair<double, int32_t>> near;
    near.reserve(nodes.size());
    for (size_t i = 0; i < nodes.size(); ++i) {
        const Vec3<double> d = nodes[i] - place;
        near.emplace_back(dot(d, d), static_cast<int32_t>(i));
    }
    if (!piece.empty() && !near.empty()) {
        const auto of = [&](const auto& entry) { return piece[static_cast<size_t>(entry.second)]; };
        const uint8_t nearest = of(*std::min_element(near.begin(), near.end()));
        std::erase_if(near, [&](const auto& entry) { return of(entry) != nearest; });
    }
    const size_t used = std::min(NearestNodes::kNodes, near.size());
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(used), near.end());
    NearestNodes anchor;
    const double spread = 2 * std::pow(decisions::Anchors::kAnchorReach * spacing_mm, 2);
    for (size_t k = 0; k < used; ++k) {
        anchor.node[k] = near[k].second;
        anchor.weight[k] = std::exp((near[0].first - near[k].first) / spread);
    }
    return anchor;
}

DualQuaternion<double> follow_nearest_nodes(const NearestNodes& anchor, std::span<const float> rest,
                                            std::span<const defrec_motion> motions) {
    RigidFit fit;
    for (size_t k = 0; k < NearestNodes::kNodes; ++k) {
        const auto node = static_cast<size_t>(anchor.node[k]);
        fit.add(anchor.weight[k], load3<double>(&rest[3 * node]),
                node_position(rest, motions, node));
    }
    return normalise(fit.solve());
}

std::vector<Vec3<double>> node_positions(std::span<const float> rest,
                                         std::span<const defrec_motion> motions) {
    std::vector<Vec3<double>> positions;
    positions.reserve(motions.size());
    for (size_t i = 0; i < motions.size(); ++i)
        positions.push_back(node_position(rest, motions, i));
    return positions;
}

}  // namespace defrec
