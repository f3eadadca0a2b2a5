// A regular lattice of points, laid over the template's image and carried by the surface: every
// node is a fixed mixture of one triangle's corners. The overlay takes its lines from one, the
// report its lighter mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdk/report/record.hpp"

namespace defrec::cli {

/// Throws std::invalid_argument, naming the disagreement, unless vertices (finite), vertex_uv
/// (finite) and triangles fit each other.
void check_template(const TemplateRecord& reference);

/// Area of the triangles in the template's image, square pixels.
double template_area(const TemplateRecord& reference);

/// Whether the frame carries geometry for a template of so many vertices.
bool has_geometry(const FrameRecord& frame, std::size_t vertices);

/// The lattice's nodes in one frame; positions of nodes that cannot be placed are NaN with status
/// unknown.
struct LatticeState {
    std::vector<float> xyz;            ///< interleaved, mm
    std::vector<VertexStatus> status;  ///< the least certain of the triangle's corners
    std::vector<float> error_mm;       ///< NaN where not known
};

class SurfaceLattice {
  public:
    SurfaceLattice() = default;

    /// step: distance of neighbouring nodes in pixels of the template's image, > 0; made larger if
    /// the lattice would exceed a million nodes. reference: as check_template accepts it.
    SurfaceLattice(const TemplateRecord& reference, double step);

    std::size_t size() const { return nodes_.size(); }
    int columns() const { return columns_; }
    int rows() const { return rows_; }

    /// Index of the node at a place of the lattice, or -1 where the template has no surface (or
    /// outside).
    std::int32_t node(int column, int row) const;

    /// u, v interleaved, pixels of the template's image.
    const std::vector<float>& uv() const { return uv_; }

    /// Whether the surface goes on from a place to the next one of the row, or of the column: not
    /// across a step between its pieces, or a cut.
    bool goes_on_right(int column, int row) const { return covers(column, row, 1, 0); }
    bool goes_on_down(int column, int row) const { return covers(column, row, 0, 1); }

    /// Takes over where the surface goes on from a lattice of the same vertices with other
    /// triangles, and of the same step.
    void part_like(const SurfaceLattice& parted);

    /// Two triangles for each cell that the surface covers.
    std::vector<std::uint32_t> triangles() const;

    /// Requires has_geometry(frame, ...) for the template given.
    void evaluate(const FrameRecord& frame, LatticeState& state) const;

    /// The template's own positions.
    std::vector<float> evaluate(const std::vector<float>& vertices) const;

  private:
    struct Node {
        std::uint32_t corner[3];
        float weight[3];
    };
    /// Places between neighbouring nodes at which the surface is looked for.
    static constexpr int kFiner = 4;
    void add_triangle(const TemplateRecord& reference, std::size_t triangle, double step);
    void place_node(const std::uint32_t* corner, const float* weight, int column, int row,
                    double step);
    /// Whether there is surface all over a rectangle from a place, as many cells wide and high.
    bool covers(int column, int row, int width, int height) const;
    std::size_t finer_columns() const {
        return static_cast<std::size_t>((columns_ - 1) * kFiner + 1);
    }

    int columns_ = 0, rows_ = 0;
    float origin_u_ = 0, origin_v_ = 0;
    std::vector<std::int32_t> index_;
    std::vector<std::uint8_t> is_covered_;  ///< kFiner times as densely as index_
    std::vector<Node> nodes_;
    std::vector<float> uv_;
};

}  // namespace defrec::cli
