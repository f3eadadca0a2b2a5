// See triangle_tree.hpp. The nearest point of a triangle by the regions of its plane (Ericson,
// Real-Time Collision Detection, 2005, 5.1.5).
#include "sdk/registration/triangle_tree.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace defrec {
namespace {

constexpr uint32_t kLeafTriangles = 4;
// Halves of 2^32 triangles.
constexpr size_t kMaxDepth = 40;

Eigen::Vector3d nearest_on_edge(const Eigen::Vector3d& place, const Eigen::Vector3d& from,
                                const Eigen::Vector3d& to) {
    const Eigen::Vector3d along = to - from;
    const double at = along.dot(place - from) / along.squaredNorm();
    return from + std::clamp(at, 0.0, 1.0) * along;
}

Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& place,
                                    const std::array<Eigen::Vector3f, 3>& corner) {
    const Eigen::Vector3d a = corner[0].cast<double>(), b = corner[1].cast<double>(),
                          c = corner[2].cast<double>();
    const Eigen::Vector3d ab = b - a, ac = c - a, ap = place - a;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return a;
    const Eigen::Vector3d bp = place - b;
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return b;
    const Eigen::Vector3d cp = place - c;
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return c;
    const double beside_ab = d1 * d4 - d3 * d2, beside_ac = d5 * d2 - d1 * d6,
                 beside_bc = d3 * d6 - d5 * d4;
    if (beside_ab <= 0 && d1 >= 0 && d3 <= 0) return nearest_on_edge(place, a, b);
    if (beside_ac <= 0 && d2 >= 0 && d6 <= 0) return nearest_on_edge(place, a, c);
    if (beside_bc <= 0 && d4 >= d3 && d5 >= d6) return nearest_on_edge(place, b, c);
    const double sum = beside_ab + beside_ac + beside_bc;
    return a + ab * (beside_ac / sum) + ac * (beside_ab / sum);
}

}  // namespace

double TriangleTree::Box::squared_distance(const Eigen::Array3f& place) const {
    return static_cast<double>(((low - place).max(place - high)).max(0.0f).matrix().squaredNorm());
}

TriangleTree::TriangleTree(std::span<const float> vertices, std::span<const uint32_t> triangles)
    : faces_(triangles.size() / 3), order_(faces_.size()) {
    for (size_t i = 0; i < faces_.size(); ++i) {
        Face& face = faces_[i];
        for (size_t k = 0; k < 3; ++k)
            face.corner[k] =
                Eigen::Map<const Eigen::Vector3f>(&vertices[3 * size_t{triangles[3 * i + k]}]);
        face.normal = (face.corner[1] - face.corner[0])
                          .cast<double>()
                          .cross((face.corner[2] - face.corner[0]).cast<double>())
                          .normalized()
                          .cast<float>();
    }
    std::iota(order_.begin(), order_.end(), 0u);
    nodes_.reserve(faces_.size() + 1);
    nodes_.emplace_back();
    build(0, 0, static_cast<uint32_t>(faces_.size()));
}

TriangleTree::Box TriangleTree::box_of(uint32_t triangle) const {
    const auto& corner = faces_[triangle].corner;
    return {corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]).array(),
            corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]).array()};
}

// Halves the triangles along the longest side of their box. Recurses kMaxDepth deep at most.
void TriangleTree::build(uint32_t node, uint32_t first, uint32_t last) {
    Box box = box_of(order_[first]);
    for (uint32_t i = first + 1; i < last; ++i) box.include(box_of(order_[i]));
    nodes_[node] = {box, first, last - first};
    if (last - first <= kLeafTriangles) return;
    Eigen::Index axis = 0;
    (box.high - box.low).maxCoeff(&axis);
    const uint32_t middle = first + (last - first) / 2;
    const auto place = [&](uint32_t triangle) {
        const auto& corner = faces_[triangle].corner;
        return std::pair(corner[0][axis] + corner[1][axis] + corner[2][axis], triangle);
    };
    std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                     [&](uint32_t a, uint32_t b) { return place(a) < place(b); });
    const auto child = static_cast<uint32_t>(nodes_.size());
    nodes_[node].first = child;
    nodes_[node].count = 0;
    nodes_.resize(nodes_.size() + 2);
    build(child, first, middle);
    build(child + 1, middle, last);
}

void TriangleTree::look_at(uint32_t triangle, const Eigen::Vector3d& place,
                           const Eigen::Vector3d* viewer, std::optional<Nearest>& best) const {
    const Face& face = faces_[triangle];
    if (viewer != nullptr &&
        face.normal.cast<double>().dot(*viewer - face.corner[0].cast<double>()) <= 0)
        return;
    const Eigen::Vector3d at = nearest_on_triangle(place, face.corner);
    const double squared = (at - place).squaredNorm();
    if (!best || squared < best->squared) best = Nearest{triangle, at, squared};
}

std::optional<TriangleTree::Nearest> TriangleTree::nearest(const Eigen::Vector3d& place,
                                                           const Eigen::Vector3d* viewer,
                                                           uint32_t guess) const {
    struct Open {
        uint32_t node;
        double squared;
    };
    const Eigen::Array3f at = place.cast<float>().array();
    std::optional<Nearest> best;
    if (guess < faces_.size()) look_at(guess, place, viewer, best);
    const auto is_far = [&](double squared) { return best && squared >= best->squared; };
    std::array<Open, 2 * kMaxDepth> open;
    size_t count = 0;
    open[count++] = {0, nodes_[0].box.squared_distance(at)};
    while (count > 0) {
        const Open next = open[--count];
        if (is_far(next.squared)) continue;
        const Node& node = nodes_[next.node];
        for (uint32_t i = 0; i < node.count; ++i)
            look_at(order_[node.first + i], place, viewer, best);
        if (node.count > 0) continue;
        Open near{node.first, nodes_[node.first].box.squared_distance(at)};
        Open far{node.first + 1, nodes_[node.first + 1].box.squared_distance(at)};
        if (far.squared < near.squared) std::swap(near, far);
        if (!is_far(far.squared)) open[count++] = far;
        if (!is_far(near.squared)) open[count++] = near;
    }
    return best;
}

}  // namespace defrec
