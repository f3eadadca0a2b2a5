// The plugin `reference`: backends/reference, the definition of every stage, behind the plugin ABI.
#include "backends/reference/stages.hpp"
#include "plugins/base/host_plugin.hpp"

namespace defrec::reference {
constexpr auto kMakers = makers_of<DEFREC_STAGES(DEFREC_STAGE_MAKER, DEFREC_COMMA)>();
}  // namespace defrec::reference

namespace {
using namespace defrec;

const HostPluginDescription kDescription{
    "reference",
    DEFREC_RELEASE,
    "Reference, plain code on one thread",
    reference::kMakers,
};
}  // namespace

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
    return enter_host_plugin(kDescription, host, out);
}
