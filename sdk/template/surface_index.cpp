// See surface_index.hpp.
#include "sdk/template/surface_index.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace defrec {
namespace {

using Point = Vec3<double>;

constexpr int64_t kCells = int64_t{1} << 20;  // along an axis, at most

int64_t axis_cell(double position, double side) {
    const double cell = std::floor(position / side);
    return static_cast<int64_t>(std::clamp(cell, -0.5 * kCells + 2, 0.5 * kCells - 2)) + kCells / 2;
}

int64_t key(int64_t x, int64_t y, int64_t z) { return (z * kCells + y) * kCells + x; }

// Barycentric weights of the point of a triangle that is nearest to the origin: that of its plane,
// taken into the triangle.
std::array<double, 3> nearest_weights(Point a, Point b, Point c) {
    const Point ab = b - a, ac = c - a, to = -1.0 * a;
    const double d00 = dot(ab, ab), d01 = dot(ab, ac), d11 = dot(ac, ac), d20 = dot(to, ab),
                 d21 = dot(to, ac), determinant = d00 * d11 - d01 * d01;
    std::array<double, 3> weight{1, 0, 0};
    if (!(determinant > 1e-12)) return weight;
    weight[1] = (d11 * d20 - d01 * d21) / determinant;
    weight[2] = (d00 * d21 - d01 * d20) / determinant;
    weight[0] = 1 - weight[1] - weight[2];
    double sum = 0;
    for (double& w : weight) sum += w = std::max(0.0, w);
    for (double& w : weight) w /= sum;
    return weight;
}

}  // namespace

SurfaceIndex::SurfaceIndex(const TemplateData& data) {
    for (const SurfacePatch& part : data.parts) side_ = std::max(side_, 2.0 * part.step_mm);
    for (size_t i = 0; i < data.vertices.size(); ++i) {
        const Point p = load3<double>(data.vertices[i].position);
        const double xyz[3] = {p.x, p.y, p.z};
        sorted_.push_back({cell_of(xyz), static_cast<int32_t>(i)});
    }
    std::stable_sort(sorted_.begin(), sorted_.end(),
                     [](const Entry& a, const Entry& b) { return a.cell < b.cell; });
    first_.assign(data.vertices.size() + 1, 0);
    for (const uint32_t corner : data.triangles) ++first_[corner + 1];
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    triangle_.resize(data.triangles.size());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (size_t i = 0; i < data.triangles.size(); ++i)
        triangle_[next[data.triangles[i]]++] = static_cast<uint32_t>(i / 3);
}

int64_t SurfaceIndex::cell_of(const double xyz[3]) const {
    return key(axis_cell(xyz[0], side_), axis_cell(xyz[1], side_), axis_cell(xyz[2], side_));
}

int32_t SurfaceIndex::nearest_vertex(const TemplateData& data, const double xyz[3]) const {
    const Point to{xyz[0], xyz[1], xyz[2]};
    if (!std::isfinite(to.x + to.y + to.z)) return -1;
    const int64_t x = axis_cell(to.x, side_), y = axis_cell(to.y, side_),
                  z = axis_cell(to.z, side_);
    int32_t nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int64_t dz = -1; dz <= 1; ++dz)
        for (int64_t dy = -1; dy <= 1; ++dy) {
            const int64_t last = key(x + 1, y + dy, z + dz);
            auto entry = std::lower_bound(sorted_.begin(), sorted_.end(), last - 2,
                                          [](const Entry& e, int64_t at) { return e.cell < at; });
            for (; entry != sorted_.end() && entry->cell <= last; ++entry) {
                const auto vertex = static_cast<size_t>(entry->vertex);
                const Point d = load3<double>(data.vertices[vertex].position) - to;
                const double squared = dot(d, d);
                if (squared > least || (squared == least && entry->vertex > nearest)) continue;
                least = squared;
                nearest = entry->vertex;
            }
        }
    return nearest;
}

PointAnchor SurfaceIndex::anchor_of(const TemplateData& data, int32_t vertex,
                                    const double xyz[3]) const {
    const Point to{xyz[0], xyz[1], xyz[2]};
    const auto index = static_cast<size_t>(vertex);
    PointAnchor anchor;
    anchor.is_grown = true;
    anchor.corner.fill(static_cast<uint32_t>(vertex));
    std::array<double, 3> weight{1, 0, 0};
    double least = std::numeric_limits<double>::infinity();
    for (uint32_t k = first_[index]; k < first_[index + 1]; ++k) {
        const uint32_t* corner = &data.triangles[3 * size_t{triangle_[k]}];
        Point p[3];
        for (size_t c = 0; c < 3; ++c) p[c] = load3<double>(data.vertices[corner[c]].position) - to;
        const std::array<double, 3> at = nearest_weights(p[0], p[1], p[2]);
        const Point d = at[0] * p[0] + at[1] * p[1] + at[2] * p[2];
        if (dot(d, d) >= least) continue;
        least = dot(d, d);
        anchor.corner = {corner[0], corner[1], corner[2]};
        weight = at;
    }
    anchor.weights.node = {0, 1, 2, 0};
    anchor.weights.weight = {static_cast<float>(weight[0]), static_cast<float>(weight[1]),
                             static_cast<float>(weight[2]), 0};
    return anchor;
}

}  // namespace defrec
