// Finds the disparities of a pair of views before any range is known: a search over all that can
// be, in small images.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

namespace defrec {

// width x height px each; the masks' usable pixels are not 0.
struct RectifiedViews {
    uint32_t width, height;
    std::span<const uint8_t> gray[2], mask[2];
};

// All but the outermost disparities, px.
struct SeenDisparities {
    double min, max;
};

// Disparities from 0 to `max_disparity` px are searched. Empty where the views show too little
// alike.
std::optional<SeenDisparities> coarse_search(const RectifiedViews& views, uint32_t max_disparity);

}  // namespace defrec
