// The inner loops of the stage orb, each compiled for every instruction set and chosen at run time. Not the
// stage: see orb.cpp.
#pragma once
#include <cstddef>
#include <cstdint>

#include "backends/shared/orb_definition.hpp"

namespace defrec::cpu {

// Bytes (images) or elements (smoothed) that a kernel may write to the right of a row it was asked for.
constexpr size_t kOrbSlack = 64;

// An image; stride in elements.
template <class T>
struct OrbImage {
    T* data = nullptr;
    size_t stride = 0;
    T* row(size_t y) const { return data + y * stride; }
};

// Rows [first, last) of a level from the level below it (docs/stages/orb.md, "pyramid").
void orb_shrink(OrbImage<const uint8_t> source, uint32_t source_width, OrbImage<uint8_t> result,
                uint32_t width, uint32_t first, uint32_t last);
// The same for the mask.
void orb_shrink_mask(OrbImage<const uint8_t> source, OrbImage<uint8_t> result, uint32_t width, uint32_t first,
                     uint32_t last);

// Rows [first, last) of the smoothed level, which must lie inside [3, height - 3); writes columns [3, width -
// 3) and no others. width >= 37; scratch: width + kOrbSlack elements.
void orb_smooth(OrbImage<const uint8_t> image, uint32_t width, OrbImage<uint16_t> result, uint32_t first,
                uint32_t last, uint16_t* scratch);

// One row of cells: columns [kBorder, width - kBorder), rows [first, last), last - first <= cell. Writes the
// scores, with up to kOrbSlack zeros to their right, and one packed corner for each cell (score << 16 | y in
// the cell << 8 | x in the cell, 0: none). mask: data nullptr where there is none.
struct OrbBand {
    OrbImage<const uint8_t> image, mask;
    uint32_t width, first, last, cell, threshold;
    OrbImage<uint8_t> scores;
    uint32_t* corners;
};
void orb_find_corners(const OrbBand& band);

// Where the 256 first and 256 second points of one turned pattern lie from the feature, in elements of the
// smoothed image.
struct OrbOffsets {
    int32_t first[orb::kTests], second[orb::kTests];
};

// Orientation bin of the feature at this pixel.
uint32_t orb_orientation(OrbImage<const uint8_t> image, uint32_t x, uint32_t y);
// Descriptor of the feature whose smoothed pixel this is; reads up to 2 bytes behind the last sample.
void orb_describe(const uint16_t* pixel, const OrbOffsets& offsets, uint32_t* descriptor);

}  // namespace defrec::cpu
