// Which disparities stereo searches.
#pragma once
#include <cstdint>

#include "sdk/template/template.hpp"

namespace defrec {

// px
struct SearchRange {
    uint32_t min_disparity = 0;
    uint32_t disparities = 0;
    bool operator==(const SearchRange&) const = default;
};

// For a surface that is not known yet: whatever is at least min_depth_mm away.
SearchRange widest_search_range(const defrec_camera& camera, uint32_t width, float min_depth_mm);
// For a surface that was observed at the disparities of its grid and of its parts, and may come
// nearer or go farther by half.
SearchRange narrowed_search_range(const TemplateData& data, const SearchRange& widest);

}  // namespace defrec
