// registration.png: the model and the points that were seen, from three sides.
#pragma once

#include <filesystem>
#include <span>

#include "include/defrec_c.h"

namespace defrec::cli {

struct PictureInput {
    std::span<const double> model_xyz;             // of its vertices, mm, where they are seen
    std::span<const float> places;                 // xyz each, mm: what was seen
    const defrec_registration_info* registration;  // of these places, with the model's triangles
    const char* verdict;                           // of the whole
};

// Three orthogonal projections of the surface's frame: as the camera sees it, from its right, and
// from above. Points are coloured by their residual, outliers are black. Throws FileError.
void write_register_picture(const std::filesystem::path& path, const PictureInput& input);

}  // namespace defrec::cli
