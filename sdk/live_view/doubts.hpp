// Which points and targets make a followed frame less sure: by name, for the banner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sdk/live_view/view_frame.hpp"

namespace defrec::cli {

// placed: ids of points that had a place once. Points of the grid do not count.
ViewDoubts doubts_of(const std::vector<ViewPoint>& points,
                     const std::vector<TargetEstimate>& targets,
                     const std::set<std::int64_t>& placed);

// The doubts of a frame before, where they are still shown; given: all points of that frame. What
// is not among the points of now was removed, and is no longer named.
ViewDoubts doubts_that_stay(ViewDoubts doubts, std::vector<ViewPoint> given,
                            const std::vector<ViewPoint>& points,
                            const std::set<std::int64_t>& placed);

}  // namespace defrec::cli
