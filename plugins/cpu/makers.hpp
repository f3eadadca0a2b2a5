// Every stage of backend cpu as plugins/base takes them: for the plugin, and for those of tests
// that change something about it.
#pragma once
#include "backends/cpu/stages.hpp"
#include "plugins/base/host_plugin.hpp"

namespace defrec::cpu {

inline constexpr std::array kMakers = makers_of<DEFREC_STAGES(DEFREC_STAGE_MAKER, DEFREC_COMMA)>();

}  // namespace defrec::cpu
