// Contract of stage orb: constants, buffers and checks, once for all backends. docs/stages/orb.md.
// Shaders include this file as well, for the part outside __cplusplus.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/orb_constants.h"
#ifdef __cplusplus
#include <algorithm>
#include <array>

#include "backends/stages/contract.hpp"

namespace defrec::orb {
#endif

struct OrbConstants {
    int levels, cells;  // cells: of all levels
    int cell, threshold, spacing, capacity;
    int stride;  // of the gray image and the mask, bytes
    int halvings;
};

// A level of the pyramid on a device: rows are padded to words of four pixels, and what is beyond
// the width means nothing.
struct OrbLevel {
    int width, height;             // px
    int cells_x, cells_y;          // 0 where the border leaves nothing
    int stride;                    // px, a multiple of 4
    uint first;                    // px of the pyramid before this level
    uint first_cell, first_pixel;  // where the levels stand without gaps
};

#ifdef __cplusplus
static_assert(kFarthest == kOrbMaxSpacing);

// One level of the pyramid and where its parts lie when the levels stand one after the other
// without padding.
struct Level {
    uint32_t width, height;     // px
    uint32_t cells_x, cells_y;  // 0 where the border leaves nothing
    size_t first_pixel, first_cell;
};

struct Layout {
    uint32_t levels = 0;  // those with a pixel
    std::array<Level, kOrbMaxLevels> level{};
    size_t pixels = 0, cells = 0;  // of all levels
};

inline Layout make_layout(const defrec_orb_params& params) {
    Layout layout;
    const auto cells = [&](uint32_t side) {
        return side > 2 * uint32_t(kBorder)
                   ? (side - 2 * uint32_t(kBorder) + params.cell - 1) / params.cell
                   : 0;
    };
    const uint32_t max_levels = std::min(params.levels, uint32_t(kOrbMaxLevels));
    const uint32_t halvings = std::min(params.halvings, uint32_t(kOrbMaxHalvings));
    uint32_t width = params.width >> halvings, height = params.height >> halvings;
    for (; layout.levels < max_levels && width > 0 && height > 0;
         width = width * 4 / 5, height = height * 4 / 5) {
        Level& level = layout.level[layout.levels++];
        level = {width, height, cells(width), cells(height), layout.pixels, layout.cells};
        if (level.cells_x == 0 || level.cells_y == 0) level.cells_x = level.cells_y = 0;
        layout.pixels += size_t(width) * height;
        layout.cells += size_t(level.cells_x) * level.cells_y;
    }
    return layout;
}

constexpr OrbConstants constants_of(const defrec_orb_params& p, const Layout& layout) {
    return {.levels = int(layout.levels),
            .cells = int(layout.cells),
            .cell = int(p.cell),
            .threshold = int(p.threshold),
            .spacing = int(p.spacing),
            .capacity = int(p.capacity),
            .stride = int(p.stride),
            .halvings = int(p.halvings)};
}

inline std::array<OrbLevel, kOrbMaxLevels> device_levels(const Layout& layout) {
    std::array<OrbLevel, kOrbMaxLevels> levels{};
    uint32_t pixels = 0;
    for (uint32_t l = 0; l < layout.levels; ++l) {
        const Level& level = layout.level[l];
        const uint32_t stride = (level.width + 3) / 4 * 4;
        levels[l] = {int(level.width),
                     int(level.height),
                     int(level.cells_x),
                     int(level.cells_y),
                     int(stride),
                     pixels,
                     uint32_t(level.first_cell),
                     uint32_t(level.first_pixel)};
        pixels += stride * level.height;
    }
    return levels;
}
// Elements of all levels together.
inline uint64_t device_pixels(const Layout& layout) {
    const OrbLevel last = device_levels(layout)[layout.levels - 1];
    return last.first + uint64_t(last.stride) * uint64_t(last.height);
}

// Optional ones are nullptr where not given.
struct OrbBuffers {
    static constexpr const char* kName = "orb";
    const uint8_t *gray, *mask;
    uint32_t* count;
    defrec_feature* features;
    uint8_t* pyramid;
    uint16_t* smoothed;
    uint8_t* scores;
    uint32_t* corners;
    uint8_t* distances;

    struct Sizes {
        const defrec_orb_params& params;
        const Layout& layout;
    };
    template <class List>
    void list(List& list, const Sizes& sizes) {
        const defrec_orb_params& p = sizes.params;
        const uint64_t image = image_elements(p.width, p.height, p.stride);
        list.input("gray", gray, image);
        list.optional_input("mask", mask, image);
        list.output("feature count", count, 1);
        list.output("features", features, p.capacity);
        list.optional_output("pyramid", pyramid, sizes.layout.pixels);
        list.optional_output("smoothed", smoothed, sizes.layout.pixels);
        list.optional_output("scores", scores, sizes.layout.pixels);
        list.optional_output("corners", corners, sizes.layout.cells);
        list.optional_output("distances", distances, sizes.layout.cells);
    }
};
inline OrbBuffers orb_buffers(const defrec_orb_params& params, const Layout& layout,
                              std::span<const InBuffer> in, std::span<const OutBuffer> out) {
    return view_buffers<OrbBuffers>(OrbBuffers::Sizes{params, layout}, in, out);
}

}  // namespace defrec::orb

namespace defrec {

inline BufferTable buffer_table(const defrec_orb_params& params) {
    const orb::Layout layout = orb::make_layout(params);
    return table_of<orb::OrbBuffers>(orb::OrbBuffers::Sizes{params, layout});
}

}  // namespace defrec
#endif
