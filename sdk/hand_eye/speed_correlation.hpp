// How alike two series are, at every shift of one against the other.
#pragma once
#include <cstddef>
#include <vector>

namespace defrec {

// Pearson's correlation of camera[i] with tracker[i + shift] over all i for which both are known
// (not NaN), for each shift from 0 to tracker.size() - camera.size(). NaN where these are fewer
// than min_count, or one series does not change over them. Takes time n log n, n = tracker.size().
std::vector<double> correlations(const std::vector<double>& camera,
                                 const std::vector<double>& tracker, std::size_t min_count);

}  // namespace defrec
