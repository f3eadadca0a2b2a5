// The inner loops of the stage orb, each compiled for every instruction set and chosen at run time.
// Not the stage: see orb.cpp.
#pragma once
#include <cstddef>
#include <cstdint>

#include "backends/definition/orb_definition.hpp"

namespace defrec::cpu {

// Elements that a kernel may read and write to the right of a row. All images but the caller's have
// that much room there.
constexpr size_t kOrbSlack = 64;

// An image; stride in elements.
template <class T>
struct OrbImage {
    T* data = nullptr;
    size_t stride = 0;
    T* row(size_t y) const { return data + y * stride; }
};

// Rows [first, last) of level 0 (docs/stages/orb.md, "pyramid"); scratch: width + kOrbSlack
// elements.
void orb_soften(OrbImage<const uint8_t> gray, uint32_t width, uint32_t height,
                OrbImage<uint8_t> result, uint32_t first, uint32_t last, uint16_t* scratch);
// Rows [first, last) of a level from the level below it.
void orb_shrink(OrbImage<const uint8_t> source, OrbImage<uint8_t> result, uint32_t width,
                uint32_t first, uint32_t last);
// The same for the mask.
void orb_shrink_mask(OrbImage<const uint8_t> source, OrbImage<uint8_t> result, uint32_t width,
                     uint32_t first, uint32_t last);

// Rows [first, last) of the smoothed level, which must lie inside [2, height - 2); writes columns
// [2, width - 2) and no others. scratch: width + kOrbSlack elements.
void orb_smooth(OrbImage<const uint8_t> image, uint32_t width, OrbImage<uint16_t> result,
                uint32_t first, uint32_t last, uint16_t* scratch);

// The smoothed pixels round the feature at this pixel, up to kPatchRadius away, first the upper
// left: rows of kOrbPatchSide, of which the last element is of no use.
constexpr int32_t kOrbPatchSide = 2 * orb::kPatchRadius + 2;
void orb_smooth_patch(OrbImage<const uint8_t> image, uint32_t x, uint32_t y, uint16_t* patch);

// One row of cells: columns [kBorder, width - kBorder), rows [first, last), last - first <= cell.
// Writes the scores, those of row first to row 0, with up to kOrbSlack zeros to their right, and
// one packed corner for each cell (score << 16 | y in the cell << 8 | x in the cell, 0: none).
// mask: data nullptr where there is none.
struct OrbBand {
    OrbImage<const uint8_t> image, mask;
    uint32_t width, first, last, cell, threshold;
    OrbImage<uint8_t> scores;
    uint32_t* corners;
};
void orb_find_corners(const OrbBand& band);

// The corners of a level as arrays of cells, with a rim of kOrbRim cells of score 0 on every side.
constexpr size_t kOrbRim = 3;
struct OrbCells {
    uint32_t cells_x = 0, cells_y = 0;
    size_t stride = 0;                                     // elements
    int16_t *x = nullptr, *y = nullptr, *score = nullptr;  // the first cell's
};
// Distance to the nearest stronger corner among the kOrbRim rings of cells round each cell of a
// row, else kFarthest; 0 without a corner. Writes up to kOrbSlack elements behind the row.
void orb_near_distances(const OrbCells& cells, uint32_t row, uint8_t* distances);

// Where the score peaks round the corner at this pixel, 1/16 px from it.
orb::Offset orb_refine(OrbImage<const uint8_t> image, uint32_t x, uint32_t y);

// Where the points of one turned pattern lie, in elements of the smoothed patch.
struct OrbOffsets {
    struct Test {
        int32_t first, second;
    } test[orb::kTests];
};

// Orientation bin of the feature at this pixel.
uint32_t orb_orientation(OrbImage<const uint8_t> image, uint32_t x, uint32_t y);
// Descriptor of the feature whose smoothed patch this is.
void orb_describe(const uint16_t* patch, const OrbOffsets& offsets, uint32_t* descriptor);

}  // namespace defrec::cpu
