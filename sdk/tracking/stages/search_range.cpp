// See search_range.hpp.
#include "sdk/tracking/stages/search_range.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/base/util/error.hpp"
#include "sdk/tracking/decisions/disparity.hpp"
#include "sdk/tracking/stages/coarse_search.hpp"

namespace defrec {
namespace {

using Decision = decisions::SearchRange;

uint32_t round_up(double disparity) {
    return static_cast<uint32_t>(std::ceil(std::max(disparity, 1.0) / Decision::kStep)) *
           Decision::kStep;
}

}  // namespace

SearchRange plausible_search_range(const defrec_camera& camera, uint32_t width,
                                   float min_depth_mm) {
    const double nearest =
        camera.fx * camera.baseline_mm / min_depth_mm - camera.disparity_offset_px;
    return {0, std::clamp(round_up(std::min(nearest, Decision::kMaxShare * width)),
                          Decision::kMinDisparities, Decision::kEnd)};
}

SearchRange widest_search_range(const SearchRange& plausible) {
    return {0, std::min(plausible.disparities, Decision::kMaxDisparities)};
}

SearchRange placed_search_range(const SearchRange& plausible, const SeenDisparities& seen) {
    const SearchRange widest = widest_search_range(plausible);
    const uint32_t to = std::min(round_up(seen.max + Decision::kSeenMargin), plausible.disparities);
    if (to <= widest.disparities) return widest;
    const uint32_t nearest = to - widest.disparities;  // with room for what is farther
    const uint32_t from = static_cast<uint32_t>(std::max(seen.min - Decision::kSeenMargin, 0.0)) /
                          Decision::kStep * Decision::kStep;
    const uint32_t begin = std::min({from, nearest, Decision::kMaxBegin});
    return {begin, std::min(to - begin, Decision::kMostDisparities)};
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
    maximum = std::max(maximum - offset, 0.f);
    const double reach = offset > 0 ? Decision::kReach * data.width : 0;
    const double nearest = std::max(Decision::kAbove * maximum, maximum + reach),
                 farthest = std::clamp(minimum - reach, 0.0, Decision::kBelow * minimum);
    const uint32_t own = round_up(maximum + Decision::kMargin);
    const uint32_t limit = std::max(widest.min_disparity + widest.disparities, own);
    const uint32_t to = std::min(round_up(nearest + Decision::kMargin), limit);
    // Where not all fits, room for tissue to go farther is given up for the nearest that was seen.
    constexpr uint32_t kMost = Decision::kMostDisparities;
    const uint32_t from =
        std::min(std::max(static_cast<uint32_t>(farthest) / Decision::kStep * Decision::kStep,
                          std::max(std::min(to, own), kMost) - kMost),
                 Decision::kMaxBegin);
    return {from, std::clamp(to - from, Decision::kMinDisparities, Decision::kMostDisparities)};
}

std::string describe(const SearchRange& range, const defrec_camera& camera) {
    const uint32_t end = range.min_disparity + range.disparities;
    const auto depth = [&](uint32_t disparity) {
        const double mm = camera.fx * camera.baseline_mm / (disparity + camera.disparity_offset_px);
        return std::round(10 * mm) / 10;
    };
    const std::string text = concat("disparities ", range.min_disparity, " to ", end,
                                    " px, depths from ", depth(end), " mm");
    if (range.min_disparity + camera.disparity_offset_px <= 0) return text;
    return concat(text, " to ", depth(range.min_disparity), " mm");
}

}  // namespace defrec
