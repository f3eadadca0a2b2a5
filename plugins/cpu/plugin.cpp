// The plugin `cpu`: backends/cpu behind the plugin ABI.
#include "plugins/cpu/makers.hpp"

namespace {
using namespace defrec;

const HostPluginDescription kDescription{
    "cpu",
    DEFREC_RELEASE,
    nullptr,
    cpu::kMakers,
};
}  // namespace

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
    return enter_host_plugin(kDescription, host, out);
}
