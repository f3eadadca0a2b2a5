// See node_edges.hpp.
#include "sdk/template/node_edges.hpp"

#include <algorithm>
#include <cmath>

namespace defrec {

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
    for (size_t a = 0; a < count; ++a)
        for (size_t b = std::max(a + 1, first); b < count; ++b) {
            if (data.piece_of_node(a) != data.piece_of_node(b)) continue;
            const double d = node_distance(data.nodes, a, b) / data.node_spacing_mm;
            if (d > 2.5) continue;
            data.edges.push_back({static_cast<int32_t>(a), static_cast<int32_t>(b),
                                  static_cast<float>(std::exp(-0.5 * (d / 1.5) * (d / 1.5)))});
        }
}

}  // namespace defrec
