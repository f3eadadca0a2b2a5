// See surface_depth.hpp.
#include "sdk/live_view/surface_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace defrec::cli {
namespace {

// Weights of the corners at the triangle's point that is nearest to p. C. Ericson, Real-Time
// Collision Detection, 2005, 5.1.5.
cv::Vec3f nearest_weights(const cv::Vec3f& p, const cv::Vec3f& a, const cv::Vec3f& b,
                          const cv::Vec3f& c) {
    const cv::Vec3f ab = b - a, ac = c - a;
    const float d1 = ab.dot(p - a), d2 = ac.dot(p - a);
    if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
    const float d3 = ab.dot(p - b), d4 = ac.dot(p - b);
    if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
    const float on_ab = d1 * d4 - d3 * d2;
    if (on_ab <= 0 && d1 >= 0 && d3 <= 0) return {d3 / (d3 - d1), d1 / (d1 - d3), 0};
    const float d5 = ab.dot(p - c), d6 = ac.dot(p - c);
    if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
    const float on_ac = d5 * d2 - d1 * d6;
    if (on_ac <= 0 && d2 >= 0 && d6 <= 0) return {d6 / (d6 - d2), 0, d2 / (d2 - d6)};
    const float on_bc = d3 * d6 - d5 * d4, to_c = d4 - d3, to_b = d5 - d6;
    if (on_bc <= 0 && to_c >= 0 && to_b >= 0)
        return {0, to_b / (to_b + to_c), to_c / (to_b + to_c)};
    return cv::Vec3f(on_bc, on_ac, on_ab) / (on_bc + on_ac + on_ab);
}

bool is_known(const cv::Vec3f& place) { return std::isfinite(place[0] + place[1] + place[2]); }

cv::Vec3f place_of(const std::vector<float>& xyz, std::size_t vertex) {
    return {xyz[3 * vertex], xyz[3 * vertex + 1], xyz[3 * vertex + 2]};
}

}  // namespace

SurfaceDepth::SurfaceDepth(std::span<const float> vertices,
                           std::span<const std::uint32_t> triangles)
    : first_(vertices.size() / 3 + 1), is_edge_(vertices.size() / 3) {
    for (std::size_t i = 0; i + 2 < vertices.size(); i += 3)
        vertices_.emplace_back(vertices[i], vertices[i + 1], vertices[i + 2]);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> sides;
    for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
        const Corners corners{triangles[i], triangles[i + 1], triangles[i + 2]};
        if (!std::all_of(corners.begin(), corners.end(),
                         [&](std::uint32_t v) { return is_known(vertices_[v]); }))
            continue;
        triangles_.push_back(corners);
        for (std::size_t k = 0; k < 3; ++k) {
            ++first_[corners[k] + 1];
            sides.push_back(std::minmax(corners[k], corners[(k + 1) % 3]));
        }
    }
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
        if (first_[v + 1] > 0) known_.push_back(static_cast<std::uint32_t>(v));
        first_[v + 1] += first_[v];
    }
    of_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t t = 0; t < triangles_.size(); ++t)
        for (const std::uint32_t v : triangles_[t]) of_[next[v]++] = static_cast<std::uint32_t>(t);
    // A side of the surface's edge has one triangle.
    std::sort(sides.begin(), sides.end());
    for (std::size_t i = 0; i < sides.size(); ++i)
        if ((i == 0 || sides[i - 1] != sides[i]) &&
            (i + 1 == sides.size() || sides[i + 1] != sides[i]))
            is_edge_[sides[i].first] = is_edge_[sides[i].second] = true;
}

std::optional<SurfaceDepth::Depth> SurfaceDepth::of(const cv::Vec3f& place) const {
    const auto squared = [](const cv::Vec3f& v) { return v.dot(v); };
    float least = std::numeric_limits<float>::infinity();
    std::uint32_t nearest = 0;
    for (const std::uint32_t v : known_)
        if (const float distance = squared(place - vertices_[v]); distance < least)
            least = distance, nearest = v;
    if (!std::isfinite(least)) return std::nullopt;
    least = std::numeric_limits<float>::infinity();
    Depth depth{0, place, {}};
    bool is_beneath = false;
    for (std::size_t i = first_[nearest]; i < first_[nearest + 1]; ++i) {
        const Corners& corners = triangles_[of_[i]];
        const cv::Vec3f &a = vertices_[corners[0]], &b = vertices_[corners[1]],
                        &c = vertices_[corners[2]];
        const cv::Vec3f weights = nearest_weights(place, a, b, c);
        const cv::Vec3f above = weights[0] * a + weights[1] * b + weights[2] * c;
        if (!(squared(place - above) < least)) continue;
        least = squared(place - above);
        is_beneath = false;
        for (std::size_t k = 0; k < 3; ++k)
            if (weights[static_cast<int>(k)] > 0 && !is_edge_[corners[k]]) is_beneath = true;
        // A triangle whose corners all lie on the edge has an inside as well.
        if (weights[0] > 0 && weights[1] > 0 && weights[2] > 0) is_beneath = true;
        cv::Vec3f away = (b - a).cross(c - a);
        if (away.dot(above) < 0) away = -away;
        depth.above = above;
        depth.mm = std::copysign(std::sqrt(least), away.dot(place - above));
    }
    if (!is_beneath) return std::nullopt;
    return depth;
}

std::optional<SurfaceDepth::Depth> SurfaceDepth::of(const PlanEstimate& plan,
                                                    const PlanModel::Part& part) const {
    std::optional<Depth> least, last;
    for (std::size_t i = 3 * part.first_triangle;
         i < 3 * (part.first_triangle + part.triangle_count); ++i) {
        const std::uint32_t vertex = plan.model->triangles[i];
        if (vertex >= plan.status.size() || plan.status[vertex] == VertexStatus::unknown) continue;
        const cv::Vec3f place = place_of(plan.vertices, vertex);
        // From one place to another the depth changes by no more than the way between them.
        if (last && last->mm - cv::norm(place - last->place) >= least->mm) continue;
        last = of(place);
        if (last && (!least || last->mm < least->mm)) least = last;
    }
    return least;
}

}  // namespace defrec::cli
