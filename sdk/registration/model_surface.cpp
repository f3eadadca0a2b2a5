// See model_surface.hpp.
#include "sdk/registration/model_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "sdk/base/util/error.hpp"
#include "sdk/base/util/median.hpp"
#include "sdk/registration/decisions.hpp"

namespace defrec {
namespace {

using decisions::RegistrationModel;

}  // namespace

ModelSurface::ModelSurface(std::span<const float> vertices, std::span<const uint32_t> triangles,
                           std::string_view name) {
    const size_t count = triangles.size() / 3;
    if (count > RegistrationModel::kMaxTriangles)
        fail(DEFREC_ERROR_ARGUMENT, name, " has ", count, " triangles, expected ",
             RegistrationModel::kMaxTriangles, " at most: reduce it, a triangle of 2 mm is enough");
    vertices_.assign(vertices.begin(), vertices.end());
    triangles_.assign(triangles.begin(), triangles.end());
    check_vertices(name);
    drop_triangles_without_area(name);
    check_size(name);
    look_at_edges();
    measure();
    tree_ = std::make_unique<const TriangleTree>(vertices_, triangles_);
}

Eigen::Vector3d ModelSurface::area_vector(size_t triangle) const {
    const Eigen::Vector3d a = vertex(triangles_[3 * triangle]);
    return (vertex(triangles_[3 * triangle + 1]) - a)
               .cross(vertex(triangles_[3 * triangle + 2]) - a) /
           2;
}

void ModelSurface::check_vertices(std::string_view name) const {
    const size_t count = vertices_.size() / 3;
    for (size_t i = 0; i < vertices_.size(); ++i)
        if (!std::isfinite(vertices_[i]))
            fail(DEFREC_ERROR_ARGUMENT, name, ": vertex ", i / 3, " is (", vertices_[i - i % 3],
                 " ", vertices_[i - i % 3 + 1], " ", vertices_[i - i % 3 + 2],
                 "), expected finite coordinates");
    for (size_t i = 0; i < triangles_.size(); ++i)
        if (triangles_[i] >= count)
            fail(DEFREC_ERROR_ARGUMENT, name, ": triangle ", i / 3, " has vertex ", triangles_[i],
                 ", expected less than the number of vertices, ", count);
    if (triangles_.empty())
        fail(DEFREC_ERROR_ARGUMENT, name, " has no triangles, expected the surface of an organ");
}

void ModelSurface::check_size(std::string_view name) const {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Vector3d high = -low;
    for (const uint32_t each : triangles_) {
        low = low.cwiseMin(vertex(each));
        high = high.cwiseMax(vertex(each));
    }
    const auto side = static_cast<float>((high - low).maxCoeff());
    if (side < RegistrationModel::kMinSide)
        fail(DEFREC_ERROR_ARGUMENT, name, " looks like metres: the largest side of its box is ",
             side, ", expected ", RegistrationModel::kMinSide, "..", RegistrationModel::kMaxSide,
             " mm");
    if (side > RegistrationModel::kMaxSide)
        fail(DEFREC_ERROR_ARGUMENT, name,
             " looks like micrometres: the largest side of its box is ", side, ", expected ",
             RegistrationModel::kMinSide, "..", RegistrationModel::kMaxSide, " mm");
}

void ModelSurface::drop_triangles_without_area(std::string_view name) {
    size_t kept = 0;
    for (size_t i = 0; i < triangle_count(); ++i) {
        const Eigen::Vector3d a = vertex(triangles_[3 * i]), b = vertex(triangles_[3 * i + 1]),
                              c = vertex(triangles_[3 * i + 2]);
        const double longest =
            std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
        if (2 * area_vector(i).norm() <= RegistrationModel::kMinHeight * longest) continue;
        std::copy_n(&triangles_[3 * i], 3, &triangles_[3 * kept]);
        ++kept;
    }
    findings_.dropped_triangles = triangle_count() - kept;
    triangles_.resize(3 * kept);
    if (kept == 0)
        fail(DEFREC_ERROR_ARGUMENT, name, ": none of its ", findings_.dropped_triangles,
             " triangles has an area, expected the surface of an organ");
}

std::vector<uint32_t> ModelSurface::merged_vertices() const {
    std::vector<uint32_t> order(vertices_.size() / 3), first(order.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto key = [&](uint32_t i) {
        // -0 and 0 are one place.
        return std::array<float, 3>{vertices_[3 * size_t{i}] + 0.0f,
                                    vertices_[3 * size_t{i} + 1] + 0.0f,
                                    vertices_[3 * size_t{i} + 2] + 0.0f};
    };
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
        const auto one = key(a), other = key(b);
        return one < other || (one == other && a < b);
    });
    for (size_t i = 0; i < order.size(); ++i)
        first[order[i]] =
            i > 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];
    return first;
}

// Two triangles at an edge of a closed mesh, one in each direction.
void ModelSurface::look_at_edges() {
    const std::vector<uint32_t> merged = merged_vertices();
    std::vector<Edge> edges;
    edges.reserve(triangles_.size());
    for (uint32_t i = 0; i < triangles_.size(); ++i) {
        const uint64_t from = merged[triangles_[i]],
                       to = merged[triangles_[i - i % 3 + (i + 1) % 3]];
        edges.push_back({std::min(from, to) << 32 | std::max(from, to), i / 3, from > to});
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        return a.ends != b.ends ? a.ends < b.ends : a.triangle < b.triangle;
    });
    std::vector<double> angles;
    for (size_t i = 0; i < edges.size();) {
        size_t end = i + 1;
        while (end < edges.size() && edges[end].ends == edges[i].ends) ++end;
        if (end == i + 1) ++findings_.open_edges;
        if (end > i + 2 || (end == i + 2 && edges[i].is_back == edges[i + 1].is_back))
            ++findings_.odd_edges;
        if (end == i + 2) {
            const Eigen::Vector3d one = area_vector(edges[i].triangle),
                                  other = area_vector(edges[i + 1].triangle);
            angles.push_back(std::atan2(one.cross(other).norm(), std::abs(one.dot(other))));
        }
        i = end;
    }
    findings_.facet_angle = median(std::move(angles));
}

void ModelSurface::measure() {
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < triangle_count(); ++i) {
        const double area = area_vector(i).norm();
        moment += area / 3 *
                  (vertex(triangles_[3 * i]) + vertex(triangles_[3 * i + 1]) +
                   vertex(triangles_[3 * i + 2]));
        findings_.area_mm2 += area;
    }
    centroid_ = moment / findings_.area_mm2;
    double volume = 0;
    for (size_t i = 0; i < triangle_count(); ++i)
        volume += (vertex(triangles_[3 * i]) - centroid_).dot(area_vector(i)) / 3;
    const double edges = static_cast<double>(triangles_.size()) / 2;
    const auto is_few = [&](uint64_t count) {
        return static_cast<double>(count) <= RegistrationModel::kMaxOpenShare * edges;
    };
    has_outside_ = is_few(findings_.open_edges) && is_few(findings_.odd_edges) && volume != 0;
    if (!has_outside_) return;
    if (volume < 0) turn();
    findings_.volume_mm3 = std::abs(volume);
}

void ModelSurface::turn() {
    for (size_t i = 0; i < triangles_.size(); i += 3) std::swap(triangles_[i], triangles_[i + 1]);
    findings_.was_turned = true;
}

}  // namespace defrec
