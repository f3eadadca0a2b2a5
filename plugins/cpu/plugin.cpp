// The plugin `cpu`: backends/cpu behind the plugin ABI.
#include "backends/cpu/stages.hpp"
#include "plugins/base/host_plugin.hpp"

namespace {
using namespace defrec;

const HostPluginDescription kDescription{
    "cpu",
    DEFREC_RELEASE,
    "Processor, vector units and threads",
    {
        make_stage<cpu::make_rectify>,
        make_stage<cpu::make_stereo>,
        make_stage<cpu::make_orb>,
        make_stage<cpu::make_match>,
        make_stage<cpu::make_align>,
        make_stage<cpu::make_ransac>,
        make_stage<cpu::make_lm>,
        make_stage<cpu::make_warp>,
    },
};
}  // namespace

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL defrec_plugin_entry_v1(const defrec_host* host,
                                                                                const defrec_plugin** out) {
    return enter_host_plugin(kDescription, host, out);
}
