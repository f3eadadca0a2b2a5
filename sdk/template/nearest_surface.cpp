// See nearest_surface.hpp.
#include "sdk/template/nearest_surface.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace defrec {
namespace {

// The control point that moves a vertex most.
size_t main_node(const defrec_surface_point& vertex) {
    const auto heaviest = std::max_element(std::begin(vertex.weight), std::end(vertex.weight));
    return static_cast<size_t>(vertex.node[heaviest - std::begin(vertex.weight)]);
}

}  // namespace

NearestSurface::NearestSurface(const TemplateData& data)
    : first_(data.nodes.size() / 3 + 1, 0), vertex_(data.vertices.size()) {
    for (size_t i = 0; i < data.nodes.size(); i += 3)
        nodes_.push_back(load3<double>(&data.nodes[i]));
    for (const defrec_surface_point& vertex : data.vertices) ++first_[main_node(vertex) + 1];
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (size_t i = 0; i < data.vertices.size(); ++i)
        vertex_[next[main_node(data.vertices[i])]++] = static_cast<uint32_t>(i);
}

size_t NearestSurface::nearest_node(const Vec3<double>& place) const {
    const auto squared = [&](const Vec3<double>& node) { return dot(node - place, node - place); };
    const auto nearest =
        std::min_element(nodes_.begin(), nodes_.end(),
                         [&](const auto& a, const auto& b) { return squared(a) < squared(b); });
    return static_cast<size_t>(nearest - nodes_.begin());
}

NearestSurface::Neighbours NearestSurface::beside(const TemplateData& data,
                                                  const Vec3<double>& place) const {
    Neighbours found;
    found.anchor = nearest_nodes_at(nodes_, data.node_piece, data.node_spacing_mm, place);
    double least = std::numeric_limits<double>::infinity();
    for (const int32_t node : found.anchor.node) {
        const auto index = static_cast<size_t>(node);
        for (uint32_t k = first_[index]; k < first_[index + 1]; ++k) {
            const Vec3<double> d = load3<double>(data.vertices[vertex_[k]].position) - place;
            if (dot(d, d) >= least) continue;
            least = dot(d, d);
            found.vertex = vertex_[k];
        }
    }
    found.distance_mm = std::sqrt(least);
    return found;
}

}  // namespace defrec
