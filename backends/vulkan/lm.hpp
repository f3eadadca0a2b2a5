// Stage lm as its own tests make it.
#pragma once
#include "backends/vulkan/stages.hpp"

namespace defrec::vulkan {

// split: how many invocations share a block of the system, a power of two up to 64. By several a
// discrete device hides its latency; a processor gains nothing, and takes one.
std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, Device& device, uint32_t split);

}  // namespace defrec::vulkan
