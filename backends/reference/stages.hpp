// The definition of every stage as plain code: double precision where floating, one thread, no
// cleverness. One maker per stage; parameters arrive checked and complete. docs/stages.md defines
// what each computes.
#pragma once
#include <memory>

#include "backends/shared/stage.hpp"
#include "backends/stages/list.hpp"

namespace defrec::reference {

#define DEFREC_MAKER(name, NAME) \
    std::unique_ptr<Stage> make_##name(const defrec_##name##_params& params, const Host& host);
DEFREC_STAGES(DEFREC_MAKER, DEFREC_NOTHING)
#undef DEFREC_MAKER

}  // namespace defrec::reference
