// A closed triangle mesh in the template frame, mm, that an application gives: checked, kept, and
// asked what lies inside. Parts may lie beside each other, touch, and have cavities, whose
// triangles are counter-clockwise seen from the cavity.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "include/defrec_c.h"

namespace defrec {

class ClosedMesh {
  public:
    // Copies the mesh. Throws Error(DEFREC_ERROR_ARGUMENT), with what is wrong and where, for one
    // that is not the surface of a body: see the checks below. Triangles without an area are taken
    // where the mesh is closed with them, vertices without a triangle are in no box. name: what
    // messages call it.
    ClosedMesh(const defrec_mesh& mesh, std::string_view name);

    std::span<const float> vertices() const { return vertices_; }       // xyz each, mm
    std::span<const uint32_t> triangles() const { return triangles_; }  // three vertices each
    // The box that its triangles lie in.
    const Eigen::Vector3d& low() const { return low_; }
    const Eigen::Vector3d& high() const { return high_; }

    // False for a place that is not finite.
    bool contains(const Eigen::Vector3d& place) const;
    // Which share of a cube lies inside, 0..1: of 4 x 4 lines through it along z.
    double inside_share(const Eigen::Vector3d& centre, double edge) const;

    // Throws Error(DEFREC_ERROR_ARGUMENT) where less than half of a template's surface lies in the
    // mesh or near it: 8 mm, or a tenth of its longest side.
    void check_meets(std::span<const defrec_surface_point> surface, std::string_view name) const;

  private:
    // Where a line along z meets the surface; sign: 1 where the inside is below, -1 where above.
    struct Crossing {
        double z;
        int sign;
    };

    Eigen::Vector3d vertex(uint32_t index) const;
    size_t triangle_count() const { return triangles_.size() / 3; }
    double longest_side() const { return (high_ - low_).maxCoeff(); }
    double max_coordinate() const { return low_.cwiseAbs().cwiseMax(high_.cwiseAbs()).maxCoeff(); }

    void check_triangles(std::string_view name);
    void check_size(std::string_view name) const;
    void check_edges(std::string_view name) const;
    void check_volume(std::string_view name) const;
    void check_crossings(std::string_view name) const;
    void check_windings(std::string_view name) const;
    void check_column(double x, double y, std::vector<Crossing>& column,
                      std::string_view name) const;

    void make_grid();
    template <class Visit>
    void visit_column(double x, double y, const Visit& visit) const;
    int winding(const Eigen::Vector3d& place) const;
    // From above to below.
    void find_column(double x, double y, std::vector<Crossing>& column) const;
    double inside_length(double x, double y, double from_z, double to_z,
                         std::vector<Crossing>& column) const;
    double share_near(std::span<const defrec_surface_point> surface, double scale) const;

    std::vector<float> vertices_;
    std::vector<uint32_t> triangles_;
    Eigen::Vector3d low_, high_;

    // Triangles by the cells of a grid over x and y that they meet.
    struct Grid {
        double side = 0;
        uint32_t columns = 0, rows = 0;
        std::vector<uint32_t> first, triangles;
        uint32_t column(double x_from_low) const;
        uint32_t row(double y_from_low) const;
    } grid_;
};

}  // namespace defrec
