// Stage lm as its own tests make it.
#pragma once
#include "backends/vulkan/stages.hpp"

namespace defrec::vulkan {

// How many invocations share a control point's own block, a block above the diagonal, and a row of
// the system; powers of two up to 64. By several a discrete device hides its latency; a processor
// gains nothing, and takes one.
struct LmSplits {
    uint32_t own = 1, above = 1, row = 1;
};
std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, Device& device,
                               const LmSplits& splits);

}  // namespace defrec::vulkan
