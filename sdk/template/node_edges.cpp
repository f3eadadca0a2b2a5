// See node_edges.hpp.
#include "sdk/template/node_edges.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/template/decisions.hpp"

namespace defrec {

using decisions::Connections;

double node_distance(const std::vector<float>& nodes, size_t a, size_t b) {
    double squared = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
        const double difference = nodes[3 * a + axis] - nodes[3 * b + axis];
        squared += difference * difference;
    }
    return std::sqrt(squared);
}

void connect_nodes(TemplateData& data, size_t first) {
    const size_t count = data.nodes.size() / 3;
    const auto is_near = [&](size_t a, size_t b, double& spacings) {
        spacings = node_distance(data.nodes, a, b) / data.node_spacing_mm;
        return spacings <= Connections::kFarthestEdge &&
               data.piece_of_node(a) == data.piece_of_node(b);
    };
    struct Pair {
        size_t a, b;
        double spacings;
    };
    std::vector<Pair> pairs;
    for (size_t a = 0; a < count; ++a)
        for (size_t b = std::max(a + 1, first); b < count; ++b)
            if (double spacings = 0; is_near(a, b, spacings)) pairs.push_back({a, b, spacings});

    // Spacings to the last of the nearest, of control points that are in a pair.
    std::vector<double> reach(count, -1), near;
    const auto reach_of = [&](size_t node) {
        if (reach[node] >= 0) return reach[node];
        near.clear();
        for (size_t other = 0; other < count; ++other)
            if (double spacings = 0; other != node && is_near(node, other, spacings))
                near.push_back(spacings);
        const auto last = near.begin() + static_cast<std::ptrdiff_t>(
                                             std::min(Connections::kNeighbours, near.size()) - 1);
        std::nth_element(near.begin(), last, near.end());
        return reach[node] = *last;
    };
    for (const auto& [a, b, spacings] : pairs)
        if (spacings <= std::max(reach_of(a), reach_of(b))) {
            const double widths = spacings / Connections::kEdgeReach;
            data.edges.push_back({static_cast<int32_t>(a), static_cast<int32_t>(b),
                                  static_cast<float>(std::exp(-0.5 * widths * widths))});
        }
}

}  // namespace defrec
