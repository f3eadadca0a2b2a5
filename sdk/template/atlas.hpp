// Pieces of the images in which tissue joined, side by side in atlas images of the template's size:
// the views, after the first one, that its patches are taken from.
#pragma once
#include <optional>

#include "sdk/template/template.hpp"

namespace defrec {

// A piece of an image, px; x1, y1: beyond its end.
struct PixelBox {
    uint32_t x0, y0, x1, y1;
};

// The place of a piece: view, and how far from where it was in its image, px.
struct AtlasPlace {
    int32_t view;
    int64_t du, dv;
};

// Copies the piece, with its rim moved outward to multiples of 8 px, to the last atlas image or a
// new one; nothing where no view is left. gray: of the template's size.
std::optional<AtlasPlace> add_to_atlas(TemplateData& data, const uint8_t* gray, PixelBox piece);

}  // namespace defrec
