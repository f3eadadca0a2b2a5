// Every stage as compute shaders. One maker per stage; parameters arrive checked and complete.
// docs/stages.md defines what each computes. A maker throws StageError(DEFREC_ERROR_UNSUPPORTED)
// where the device's limits are too small.
#pragma once
#include "backends/stages/list.hpp"
#include "backends/vulkan/stage.hpp"

namespace defrec::vulkan {

#define DEFREC_MAKER(name, NAME) \
    std::unique_ptr<Stage> make_##name(const defrec_##name##_params& params, Device& device);
DEFREC_STAGES(DEFREC_MAKER, DEFREC_NOTHING)
#undef DEFREC_MAKER

}  // namespace defrec::vulkan
