// Which corners of the stage orb become features: docs/stages/orb.md, "distance" and "selection".
#pragma once
#include <array>
#include <vector>

#include "backends/cpu/orb_kernels.hpp"

namespace defrec::cpu {

struct OrbKept {
    uint16_t x, y;  // px of the level
    uint8_t level, score;
};

// The corners of all levels, one for each cell. No allocation but in the constructor; rows of cells
// may be given to different threads.
class OrbSelection {
  public:
    OrbSelection(const defrec_orb_params& params, const orb::Layout& layout,
                 const HostAllocator<uint8_t>& memory);

    // Where the packed corners of a row of cells go before take_row.
    uint32_t* row(uint32_t level, uint32_t y) { return &packed_[first_of_row(level, y)]; }
    void take_row(uint32_t level, uint32_t y);
    // After all rows of the level have been taken.
    void find_distances(uint32_t level, uint32_t y);
    // After all distances have been found: the features, in order; returns how many, at most the
    // capacity.
    uint32_t choose(HostVector<OrbKept>& kept) const;

    const HostVector<uint32_t>& packed() const { return packed_; }
    const HostVector<uint8_t>& distances() const { return distances_; }

  private:
    struct Limits {
        uint32_t distance, score;
    };
    size_t first_of_row(uint32_t level, uint32_t y) const {
        return layout_.level[level].first_cell + size_t(y) * layout_.level[level].cells_x;
    }
    int32_t look_farther(const OrbCells& cells, int32_t cell_x, int32_t cell_y,
                         int32_t nearest) const;
    Limits choose_limits() const;

    defrec_orb_params params_;
    orb::Layout layout_;
    std::array<OrbCells, kOrbMaxLevels> cells_;  // into the arrays below
    HostVector<int16_t> x_, y_, score_;          // with a rim
    HostVector<uint8_t> near_;                   // distances, laid out like those
    HostVector<uint32_t> packed_;
    HostVector<uint8_t> distances_;
};

}  // namespace defrec::cpu
