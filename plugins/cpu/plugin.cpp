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
        make_stage<defrec_rectify_params, cpu::make_rectify>,
        make_stage<defrec_stereo_params, cpu::make_stereo>,
        make_stage<defrec_orb_params, cpu::make_orb>,
        make_stage<defrec_match_params, cpu::make_match>,
        make_stage<defrec_align_params, cpu::make_align>,
        make_stage<defrec_ransac_params, cpu::make_ransac>,
        make_stage<defrec_lm_params, cpu::make_lm>,
        make_stage<defrec_warp_params, cpu::make_warp>,
    },
};
}  // namespace

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL defrec_plugin_entry_v1(const defrec_host* host,
                                                                                const defrec_plugin** out) {
    return enter_host_plugin(kDescription, host, out);
}
