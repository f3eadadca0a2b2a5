// Pieces of the template's image at which the deformed surface is compared with the live image.
#pragma once
#include <algorithm>

#include "sdk/template/decisions.hpp"
#include "sdk/template/template.hpp"

namespace defrec {

// The level of the image in which stage align searches for them where texture is fine.
constexpr uint32_t fine_check_level(uint32_t image_width) {
    return image_width >= decisions::CheckPatches::kLargeImage ? 1 : 0;
}
// The same, of a template.
inline uint32_t check_level(const TemplateData& data) {
    return std::max(fine_check_level(data.width), data.texture_level);
}

// How far it searches there, px of that level.
constexpr uint32_t check_search_radius(uint32_t image_width) {
    return decisions::CheckPatches::kCheckSearchRadius - fine_check_level(image_width);
}

// Whether the window round a pixel of an image has texture in both directions, for a template's
// checks. gray: as large as its images.
bool has_check_texture(const TemplateData& data, const uint8_t* gray, double u, double v);

// Fills checks and check_of_vertex of a template that has everything else: one patch for each piece
// of the first view's surface as large as a patch's window, where the window has texture in both
// directions.
void place_checks(TemplateData& data);

// A check whose window a cut crosses shows tissue of both sides: it is no vertex's any more.
void forget_checks_at_cuts(TemplateData& data);

}  // namespace defrec
