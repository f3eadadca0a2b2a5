// The plugin `reference`: backends/reference, the definition of every stage, behind the plugin ABI.
#include "backends/reference/stages.hpp"
#include "plugins/base/host_plugin.hpp"

namespace {
using namespace defrec;

const HostPluginDescription kDescription{
    "reference",
    DEFREC_RELEASE,
    "Reference, plain code on one thread",
    makers_of<reference::make_rectify, reference::make_stereo, reference::make_orb,
              reference::make_match, reference::make_align, reference::make_ransac,
              reference::make_lm, reference::make_warp>(),
};
}  // namespace

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
    return enter_host_plugin(kDescription, host, out);
}
