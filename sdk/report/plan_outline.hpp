// How the parts of a plan appear in the left image: the outline of what is known of each.
#pragma once

#include <cstddef>
#include <vector>

#include "sdk/report/record.hpp"

namespace defrec::cli {

/// Pixels of the left image.
struct OutlinePoint {
    float u = 0, v = 0;
    float radius = 0;         ///< as long as the expected error appears there
    bool is_unknown = false;  ///< where the part goes on, unknown: not its edge
    bool is_cut = false;      ///< where the image ends
};

struct PlanOutline {
    std::size_t part = 0;
    std::vector<std::vector<OutlinePoint>> contours;  ///< closed; also those of holes
    float expected_error_mm = 0;                      ///< root mean square over what is known
};

/// A part of which nothing is known, or that is not in the image, has none. Silhouettes are those
/// of triangles whose three vertices are known.
std::vector<PlanOutline> plan_outlines(const PlanEstimate& plan, const Projector& projector,
                                       int width, int height);

}  // namespace defrec::cli
