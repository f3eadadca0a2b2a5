// The surface of a preoperative model that a registration compares with: an application's triangle
// mesh, checked and put right, and its nearest points.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "sdk/registration/triangle_tree.hpp"

namespace defrec {

// What was found in a mesh, and what was done about it.
struct ModelFindings {
    uint64_t dropped_triangles = 0;  // without an area
    uint64_t open_edges = 0;         // of one triangle
    uint64_t odd_edges = 0;          // of more than two triangles, or of two that turn differently
    bool was_turned = false;         // it was inside out
    double volume_mm3 = 0;           // 0 for an open mesh
    double area_mm2 = 0;
    double facet_angle = 0;  // rad, between neighbours: median
};

class ModelSurface {
  public:
    // vertices: xyz each, mm; triangles: three vertices each. Vertices at the same place are one.
    // Triangles without an area are dropped, and a closed mesh that is inside out is turned. Throws
    // Error(DEFREC_ERROR_ARGUMENT) with what is wrong for coordinates that are not finite, a vertex
    // that there is not, a size that is not one in mm, too many triangles, and for none. name: what
    // messages call it.
    ModelSurface(std::span<const float> vertices, std::span<const uint32_t> triangles,
                 std::string_view name);

    std::span<const float> vertices() const { return vertices_; }
    std::span<const uint32_t> triangles() const { return triangles_; }  // those that are left
    const ModelFindings& findings() const { return findings_; }
    const TriangleTree& tree() const { return *tree_; }
    // Whether triangles are counter-clockwise seen from outside, so that a camera sees only those
    // that show it their front.
    bool has_outside() const { return has_outside_; }
    // mm, its centre of area.
    const Eigen::Vector3d& centroid() const { return centroid_; }
    // For each vertex the first one at its place: files without indices list a vertex for each of
    // its triangles.
    std::vector<uint32_t> merged_vertices() const;

  private:
    struct Edge {
        uint64_t ends;  // lower vertex << 32 | higher vertex
        uint32_t triangle;
        bool is_back;  // from the higher vertex to the lower one
    };

    Eigen::Vector3d vertex(uint32_t index) const {
        return Eigen::Map<const Eigen::Vector3f>(&vertices_[3 * size_t{index}]).cast<double>();
    }
    size_t triangle_count() const { return triangles_.size() / 3; }
    Eigen::Vector3d area_vector(size_t triangle) const;  // along the normal, as long as the area
    void check_vertices(std::string_view name) const;
    void check_size(std::string_view name) const;
    void drop_triangles_without_area(std::string_view name);
    void look_at_edges();
    void measure();
    void turn();

    std::vector<float> vertices_;
    std::vector<uint32_t> triangles_;
    ModelFindings findings_;
    Eigen::Vector3d centroid_ = Eigen::Vector3d::Zero();
    bool has_outside_ = false;
    std::unique_ptr<const TriangleTree> tree_;
};

}  // namespace defrec
