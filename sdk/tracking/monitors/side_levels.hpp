// By how much a region of the first view's grid stands off what lies beside it, from how each side
// goes on towards the outline: a slope has none, however steep, and a tear has.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"
#include "sdk/tracking/monitors/band.hpp"

namespace defrec {

class SideLevels {
  public:
    // Per cell of the grid: whether it belongs to the region, and how far its tissue moved along
    // the sight, mm, not a number where it is not seen. All must outlive it.
    SideLevels(const SurfaceGrid& grid, std::span<const uint8_t> is_inside,
               std::span<const float> moved);

    // How much more the inside moved at a place of the outline; none where too little is seen on
    // either side. reach: cells from there within which tissue counts.
    std::optional<double> step_at(const Cell& place, uint8_t piece, double reach) const;

  private:
    std::optional<double> level_at(const Cell& place, bool inside, uint8_t piece,
                                   double reach) const;

    const SurfaceGrid& grid_;
    std::span<const uint8_t> is_inside_;
    std::span<const float> moved_;
    std::vector<uint8_t> is_beside_;  // per cell: too near to the outline to count
};

}  // namespace defrec
