// See search_range.hpp.
#include "sdk/tracking/stages/search_range.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {
namespace {

using Decision = decisions::SearchRange;

uint32_t round_up(double disparity) {
    return static_cast<uint32_t>(std::ceil(std::max(disparity, 1.0) / Decision::kStep)) *
           Decision::kStep;
}

}  // namespace

SearchRange widest_search_range(const defrec_camera& camera, uint32_t width, float min_depth_mm) {
    const double nearest =
        camera.fx * camera.baseline_mm / min_depth_mm - camera.disparity_offset_px;
    return {0, std::clamp(round_up(std::min(nearest, Decision::kMaxShare * width)),
                          Decision::kMinDisparities, Decision::kMaxDisparities)};
}

SearchRange narrowed_search_range(const TemplateData& data, const SearchRange& widest) {
    const SurfaceGrid& grid = data.grid;
    float minimum = 1e9f, maximum = 0;
    for (size_t i = 0; i < grid.vertex.size(); ++i)
        if (grid.vertex[i] >= 0) {
            minimum = std::min(minimum, grid.disparity[i]);
            maximum = std::max(maximum, grid.disparity[i]);
        }
    for (const SurfacePatch& part : data.parts) {
        minimum = std::min(minimum, part.min_disparity);
        maximum = std::max(maximum, part.max_disparity);
    }
    const auto offset = static_cast<float>(data.camera.disparity_offset_px);
    minimum = std::max(minimum - offset, 0.f);
    maximum -= offset;
    const uint32_t from =
        static_cast<uint32_t>(Decision::kBelow * minimum) / Decision::kStep * Decision::kStep;
    const uint32_t limit = std::max(widest.disparities, round_up(maximum + Decision::kMargin));
    const uint32_t to = std::min(round_up(Decision::kAbove * maximum + Decision::kMargin), limit);
    return {from, std::max(to - from, Decision::kMinDisparities)};
}

}  // namespace defrec
