// See contradicted_depth.hpp.
#include "sdk/tracking/evidence/contradicted_depth.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/tracking/decisions/confidence.hpp"

namespace defrec {

using Decision = decisions::ContradictedDepth;

void ContradictedDepth::add_frame(std::span<const defrec_surface_sample> samples,
                                  std::span<const uint8_t> is_confirmed) {
    for (size_t i = 0; i < std::min(samples.size(), mm_.size()); ++i) {
        const defrec_surface_sample& sample = samples[i];
        const bool is_elsewhere =
            sample.observation == DEFREC_INCONSISTENT || sample.observation == DEFREC_OCCLUDED;
        if (sample.observation == DEFREC_OBSERVED)
            mm_[i] -= mm_[i] / Decision::kFall;
        else if (is_elsewhere && is_confirmed[i] != 0)
            mm_[i] += (std::abs(sample.residual) - mm_[i]) / Decision::kRise;
    }
}

}  // namespace defrec
