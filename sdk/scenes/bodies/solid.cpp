// Closed triangle meshes of a body's parts.
#include "sdk/scenes/bodies/solid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace defrec::cli {
namespace {

void append(std::string& bytes, std::uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) {
        bytes.push_back(static_cast<char>(word >> shift & 0xFFu));
    }
}

/// The faces of a grid of cells: `cells` along each axis, points by their places in the grid.
class GridSurface {
  public:
    explicit GridSurface(const Eigen::Array3i& cells) : cells_(cells) {
        for (int axis = 0; axis < 3; ++axis) {
            for (const bool is_high : {false, true}) add_face(axis, is_high);
        }
    }
    const std::vector<Eigen::Array3i>& places() const { return places_; }
    const std::vector<std::array<std::int32_t, 3>>& triangles() const { return triangles_; }

  private:
    std::int32_t number_of(const Eigen::Array3i& place) {
        const auto [found, is_new] = numbers_.try_emplace(
            {place.x(), place.y(), place.z()}, static_cast<std::int32_t>(places_.size()));
        if (is_new) places_.push_back(place);
        return found->second;
    }
    void add_face(int axis, bool is_high) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (int j = 0; j < cells_[v]; ++j) {
            for (int i = 0; i < cells_[u]; ++i) {
                const auto corner = [&](int di, int dj) {
                    Eigen::Array3i place;
                    place[axis] = is_high ? cells_[axis] : 0;
                    place[u] = i + di;
                    place[v] = j + dj;
                    return number_of(place);
                };
                std::array<std::int32_t, 4> quad{corner(0, 0), corner(1, 0), corner(1, 1),
                                                 corner(0, 1)};
                if (!is_high) std::swap(quad[1], quad[3]);
                triangles_.push_back({quad[0], quad[1], quad[2]});
                triangles_.push_back({quad[0], quad[2], quad[3]});
            }
        }
    }

    Eigen::Array3i cells_;
    std::vector<Eigen::Array3i> places_;
    std::vector<std::array<std::int32_t, 3>> triangles_;
    std::map<std::tuple<int, int, int>, std::int32_t> numbers_;
};

}  // namespace

SolidMesh mesh_of(const Box& box, double step) {
    const Eigen::Array3d size = box.high - box.low;
    const Eigen::Array3i cells = (size / step).ceil().cast<int>().max(1);
    const GridSurface surface(cells);
    SolidMesh mesh{{}, surface.triangles()};
    for (const Eigen::Array3i& place : surface.places()) {
        mesh.points.emplace_back(box.low.array() +
                                 size * place.cast<double>() / cells.cast<double>());
    }
    return mesh;
}

/// A cube's surface, blown up.
SolidMesh mesh_of(const Ball& ball, double step) {
    const int cells = std::max(2, static_cast<int>(std::ceil(1.6 * ball.radius / step)));
    const GridSurface surface(Eigen::Array3i::Constant(cells));
    SolidMesh mesh{{}, surface.triangles()};
    for (const Eigen::Array3i& place : surface.places()) {
        const Eigen::Vector3d direction = 2.0 * place.cast<double>() / cells - 1.0;
        mesh.points.emplace_back(ball.centre + ball.radius * direction.normalized());
    }
    return mesh;
}

std::string ply_of(const SolidMesh& mesh) {
    std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                        std::to_string(mesh.points.size()) +
                        "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                        std::to_string(mesh.triangles.size()) +
                        "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const Eigen::Vector3d& point : mesh.points) {
        for (const double x : point) {
            append(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(x)));
        }
    }
    for (const auto& triangle : mesh.triangles) {
        bytes.push_back(3);
        for (const std::int32_t corner : triangle)
            append(bytes, static_cast<std::uint32_t>(corner));
    }
    return bytes;
}

}  // namespace defrec::cli
