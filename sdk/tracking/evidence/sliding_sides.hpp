// Where a surface does not move as one: sheared between sides that slide and are not parted, and
// beside the line along which they were.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

// How much the surface is drawn out one way over the other: kPossible, as tissue may be but seldom
// is; kCertain, as it is between sides that slide.
enum class Shear : uint8_t { kNone, kPossible, kCertain };

// Worked out once for a template's frames. samples: of all vertices.
class SurfaceShear {
  public:
    explicit SurfaceShear(const TemplateData& data);

    // At a vertex.
    Shear at(size_t vertex, std::span<const defrec_surface_sample> samples) const;
    // Per vertex, the most of those round it. sheared: at() of all vertices. Tissue that joined has
    // none.
    void spread(const TemplateData& data, std::span<const Shear> sheared,
                std::span<Shear> beside) const;
    // mm by which a vertex is off that moves with neither of the sides round it: half of what
    // these moved otherwise.
    float error_between(const TemplateData& data, size_t vertex,
                        std::span<const defrec_surface_sample> samples) const;

  private:
    // A vertex of the grid with one beside it in its row and one in its column, on its side of all
    // cuts; at rest the squared lengths of both sides, their product, and the squared area.
    struct Corner {
        uint32_t in_row = 0, in_column = 0;
        float row2 = 0, column2 = 0, product = 0, area2 = 0;  // mm; area2 0: there are none
        int x = 0, y = 0;                                     // its cell of the grid
    };
    std::vector<Corner> corners_;  // per vertex
    int reach_ = 1;                // cells
};

class CutSides {
  public:
    explicit CutSides(const TemplateData& data);

    // Per vertex, mm: the expected error from the side of a cut that it may be on. That is known as
    // far as the cut's place is, and not at all where what is seen is not what is expected for so
    // many frames. 0 away from cuts. unconfirmed: SlipMonitor::unconfirmed().
    void expect(const TemplateData& data, std::span<const defrec_surface_sample> samples,
                std::span<const uint8_t> unconfirmed, std::span<float> error_mm) const;

  private:
    struct Beside {
        size_t vertex, across, behind, cell;
        float share;  // root of the probability that the vertex is on the other side
    };
    std::vector<Beside> beside_;
};

}  // namespace defrec
