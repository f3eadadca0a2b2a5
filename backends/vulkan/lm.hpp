// Stage lm as its own tests make it.
#pragma once
#include "backends/vulkan/stages.hpp"

namespace defrec::vulkan {

// How many invocations share a control point's data, its own block, a block above the diagonal, and
// a row of the system; powers of two up to 64. A processor gains nothing by several.
struct LmSplits {
    uint32_t data = 1, own = 1, above = 1, row = 1;
};
// Several hide the latency of a GPU: a control point's own block typically has 32 terms, one above
// the diagonal ten, a row nine blocks. More would find little to do, and take the place of other
// trackers' work.
constexpr LmSplits kGpuSplits{.data = 16, .own = 8, .above = 2, .row = 16};

std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, Device& device,
                               const LmSplits& splits);

}  // namespace defrec::vulkan
