// The plugin `reference`: backends/reference, the definition of every stage, behind the plugin ABI.
#include "backends/reference/stages.hpp"
#include "plugins/base/host_plugin.hpp"

namespace {
using namespace defrec;

const HostPluginDescription kDescription{
    "reference",
    DEFREC_RELEASE,
    "Reference, plain code on one thread",
    {
        make_stage<reference::make_rectify>,
        make_stage<reference::make_stereo>,
        make_stage<reference::make_orb>,
        make_stage<reference::make_match>,
        make_stage<reference::make_align>,
        make_stage<reference::make_ransac>,
        make_stage<reference::make_lm>,
        make_stage<reference::make_warp>,
    },
};
}  // namespace

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL defrec_plugin_entry_v1(const defrec_host* host,
                                                                                const defrec_plugin** out) {
    return enter_host_plugin(kDescription, host, out);
}
