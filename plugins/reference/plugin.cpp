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
        make_stage<defrec_rectify_params, reference::make_rectify>,
        make_stage<defrec_stereo_params, reference::make_stereo>,
        make_stage<defrec_orb_params, reference::make_orb>,
        make_stage<defrec_match_params, reference::make_match>,
        make_stage<defrec_align_params, reference::make_align>,
        make_stage<defrec_ransac_params, reference::make_ransac>,
        make_stage<defrec_lm_params, reference::make_lm>,
        make_stage<defrec_warp_params, reference::make_warp>,
    },
};
}  // namespace

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL defrec_plugin_entry_v1(const defrec_host* host,
                                                                                const defrec_plugin** out) {
    return enter_host_plugin(kDescription, host, out);
}
