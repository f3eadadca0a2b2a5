// See contradicted_depth.hpp.
#include "sdk/tracking/evidence/contradicted_depth.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/tracking/decisions/confidence.hpp"

namespace defrec {

using Decision = decisions::ContradictedDepth;

void ContradictedDepth::add_frame(std::span<const defrec_surface_sample> samples,
                                  std::span<const uint8_t> is_confirmed,
                                  std::span<const uint8_t> status) {
    for (size_t i = 0; i < mm_.size(); ++i) {
        if (is_confirmed[i] == 0 || status[i] == DEFREC_POINT_UNKNOWN) continue;
        const defrec_surface_sample& sample = samples[i];
        if (sample.observation == DEFREC_OBSERVED)
            mm_[i] -= mm_[i] / Decision::kFall;
        else if (sample.observation == DEFREC_INCONSISTENT || sample.observation == DEFREC_OCCLUDED)
            mm_[i] +=
                (std::min(std::abs(sample.residual), Decision::kMost) - mm_[i]) / Decision::kRise;
    }
}

}  // namespace defrec
