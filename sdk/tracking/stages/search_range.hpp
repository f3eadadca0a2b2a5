// Which disparities stereo searches.
#pragma once
#include <cstdint>
#include <string>

#include "sdk/template/template.hpp"

namespace defrec {

// px
struct SearchRange {
    uint32_t min_disparity = 0;
    uint32_t disparities = 0;
    bool operator==(const SearchRange&) const = default;
};

struct SeenDisparities;  // coarse_search.hpp

// For a surface that is not known yet: whatever is at least min_depth_mm away.
SearchRange plausible_search_range(const defrec_camera& camera, uint32_t width, float min_depth_mm);
// As much of it as is searched at once; the farthest.
SearchRange widest_search_range(const SearchRange& plausible);
// As much of it, so that what was seen lies inside; more where that is needed.
SearchRange placed_search_range(const SearchRange& plausible, const SeenDisparities& seen);
// For a surface that was observed at the disparities of its grid and of its parts, and may come
// nearer or go farther: by half, and where views converge by a share of the width at least.
SearchRange narrowed_search_range(const TemplateData& data, const SearchRange& widest);
// "disparities 16 to 96 px, depths 290.5 to 310.2 mm"
std::string describe(const SearchRange& range, const defrec_camera& camera);

}  // namespace defrec
