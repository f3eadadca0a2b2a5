// Every stage fast on a CPU: Highway with run-time dispatch, the host's threads, no allocation per
// frame. One maker per stage; parameters arrive checked and complete. docs/stages.md defines what
// each computes.
#pragma once
#include <memory>

#include "backends/shared/stage.hpp"
#include "backends/stages/list.hpp"

namespace defrec::cpu {

#define DEFREC_MAKER(name, NAME) \
    std::unique_ptr<Stage> make_##name(const defrec_##name##_params& params, const Host& host);
DEFREC_STAGES(DEFREC_MAKER, DEFREC_NOTHING)
#undef DEFREC_MAKER

}  // namespace defrec::cpu
