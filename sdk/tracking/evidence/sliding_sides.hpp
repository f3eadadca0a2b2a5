// Where a surface does not move as one: sheared between sides that slide and are not parted, and
// beside the line along which they were.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

// Worked out once for a template's frames.
class SurfaceShear {
  public:
    explicit SurfaceShear(const TemplateData& data);

    // Whether the surface is drawn out one way over the other at a vertex, by more than tissue is.
    // A check beside it then says nothing of it. samples: of all vertices.
    bool is_sheared(size_t vertex, std::span<const defrec_surface_sample> samples) const;

  private:
    // A vertex of the grid with one beside it in its row and one in its column, on its side of all
    // cuts; at rest the squared lengths of both sides, their product, and the squared area.
    struct Corner {
        uint32_t in_row = 0, in_column = 0;
        float row2 = 0, column2 = 0, product = 0, area2 = 0;  // mm; area2 0: there are none
    };
    std::vector<Corner> corners_;  // per vertex
};

class CutSides {
  public:
    explicit CutSides(const TemplateData& data);

    // Per vertex, mm: the expected error from the side of a cut that it may be on, which is known
    // as far as the cut's place is. 0 away from cuts.
    void expect(const TemplateData& data, std::span<const defrec_surface_sample> samples,
                std::span<float> error_mm) const;

  private:
    struct Beside {
        size_t vertex, across, behind;
        float share;  // root of the probability that the vertex is on the other side
    };
    std::vector<Beside> beside_;
};

}  // namespace defrec
