// Distances between corners, and the choice of those that are kept.
#include "backends/cpu/orb_selection.hpp"

#include <algorithm>
#include <cstdlib>

namespace defrec::cpu {

using orb::kBorder;
using orb::kFarthest;

OrbSelection::OrbSelection(const defrec_orb_params& params, const orb::Layout& layout,
                           const HostAllocator<uint8_t>& memory)
    : params_(params),
      layout_(layout),
      x_(memory),
      y_(memory),
      score_(memory),
      near_(memory),
      packed_(layout.cells, memory),
      distances_(layout.cells, memory) {
    size_t size = 0;
    std::array<size_t, kOrbMaxLevels> first{};
    for (uint32_t l = 0; l < layout_.levels; ++l) {
        const orb::Level& level = layout_.level[l];
        cells_[l].cells_x = level.cells_x;
        cells_[l].cells_y = level.cells_y;
        cells_[l].stride = level.cells_x + 2 * kOrbRim + kOrbSlack;
        first[l] = size + kOrbRim * cells_[l].stride + kOrbRim;
        size += (level.cells_y + 2 * kOrbRim) * cells_[l].stride;
    }
    x_.resize(size);
    y_.resize(size);
    score_.resize(size);
    near_.resize(size);
    for (uint32_t l = 0; l < layout_.levels; ++l) {
        cells_[l].x = x_.data() + first[l];
        cells_[l].y = y_.data() + first[l];
        cells_[l].score = score_.data() + first[l];
    }
}

void OrbSelection::take_row(uint32_t level, uint32_t y) {
    const OrbCells& cells = cells_[level];
    const uint32_t* corners = row(level, y);
    const size_t first = y * cells.stride;
    for (uint32_t x = 0; x < cells.cells_x; ++x) {
        cells.x[first + x] = int16_t(uint32_t(kBorder) + x * params_.cell + (corners[x] & 255));
        cells.y[first + x] =
            int16_t(uint32_t(kBorder) + y * params_.cell + (corners[x] >> 8 & 255));
        cells.score[first + x] = int16_t(corners[x] >> 16);
    }
}

void OrbSelection::find_distances(uint32_t level, uint32_t y) {
    const OrbCells& cells = cells_[level];
    uint8_t* near = near_.data() + (cells.score - score_.data()) + ptrdiff_t(y * cells.stride);
    uint8_t* distances = &distances_[first_of_row(level, y)];
    orb_near_distances(cells, y, near);
    for (uint32_t x = 0; x < cells.cells_x; ++x)
        distances[x] = uint8_t(look_farther(cells, int32_t(x), int32_t(y), near[x]));
}

// Rings of cells from the first that near distances leave out, until no cell of the next ring can
// be nearer.
int32_t OrbSelection::look_farther(const OrbCells& cells, int32_t cell_x, int32_t cell_y,
                                   int32_t nearest) const {
    const int32_t columns = int32_t(cells.cells_x), rows = int32_t(cells.cells_y),
                  cell = int32_t(params_.cell);
    const auto index = [&](int32_t x, int32_t y) { return size_t(y) * cells.stride + size_t(x); };
    const size_t own = index(cell_x, cell_y);
    const auto look = [&](int32_t x, int32_t y, bool earlier) {
        const size_t other = index(x, y);
        if (cells.score[other] > cells.score[own] ||
            (earlier && cells.score[other] == cells.score[own]))
            nearest = std::min(nearest, std::max(std::abs(cells.x[other] - cells.x[own]),
                                                 std::abs(cells.y[other] - cells.y[own])));
    };
    for (int32_t ring = int32_t(kOrbRim) + 1; (ring - 1) * cell + 1 < nearest; ++ring) {
        const int32_t left = std::max(cell_x - ring, 0),
                      right = std::min(cell_x + ring, columns - 1);
        if (cell_y - ring >= 0)
            for (int32_t x = left; x <= right; ++x) look(x, cell_y - ring, true);
        if (cell_y + ring < rows)
            for (int32_t x = left; x <= right; ++x) look(x, cell_y + ring, false);
        for (int32_t y = std::max(cell_y - ring + 1, 0); y <= std::min(cell_y + ring - 1, rows - 1);
             ++y) {
            if (cell_x - ring >= 0) look(cell_x - ring, y, y <= cell_y);
            if (cell_x + ring < columns) look(cell_x + ring, y, y < cell_y);
        }
    }
    return nearest;
}

OrbSelection::Limits OrbSelection::choose_limits() const {
    uint32_t of_distance[kFarthest + 1] = {};
    for (const uint8_t distance : distances_) ++of_distance[distance];
    Limits limits{kFarthest + 1, 256};
    uint32_t count = 0;
    while (limits.distance > params_.spacing &&
           count + of_distance[limits.distance - 1] <= params_.capacity)
        count += of_distance[--limits.distance];
    if (limits.distance == params_.spacing) return limits;
    uint32_t of_score[256] = {};
    for (size_t i = 0; i < distances_.size(); ++i)
        if (distances_[i] + 1u == limits.distance) ++of_score[packed_[i] >> 16];
    while (limits.score > 1 && count + of_score[limits.score - 1] <= params_.capacity)
        count += of_score[--limits.score];
    return limits;
}

uint32_t OrbSelection::choose(HostVector<OrbKept>& kept) const {
    const Limits limits = choose_limits();
    uint32_t count = 0;
    for (uint32_t l = 0; l < layout_.levels; ++l) {
        const OrbCells& cells = cells_[l];
        for (uint32_t y = 0; y < cells.cells_y; ++y) {
            const uint8_t* distances = &distances_[first_of_row(l, y)];
            for (uint32_t x = 0; x < cells.cells_x; ++x) {
                const uint32_t distance = distances[x];
                if (distance + 1 < limits.distance || distance == 0) continue;
                const size_t cell = y * cells.stride + x;
                if (distance < limits.distance && uint32_t(cells.score[cell]) < limits.score)
                    continue;
                kept[count++] = {uint16_t(cells.x[cell]), uint16_t(cells.y[cell]), uint8_t(l),
                                 uint8_t(cells.score[cell])};
            }
        }
    }
    return count;
}

}  // namespace defrec::cpu
