// Puts a backend that works in host memory behind the plugin ABI: buffers, and queues that compute
// on enqueue. Knows nothing of any stage but its number.
#pragma once
#include "plugins/base/plugin.hpp"

namespace defrec {

using StageMaker = MakerOf<Stage, const Host>;

struct HostPluginDescription {
    const char* name;  // also the id of its one device
    const char* version;
    const char* device_name;  // for people; nullptr: the processor's model
    std::array<StageMaker, DEFREC_STAGE_COUNT_V1>
        makers;  // by DEFREC_STAGE_*; nullptr: not offered
};

// The body of defrec_plugin_entry_v1. Every call makes an independent instance. description lives
// as long as the process.
defrec_status enter_host_plugin(const HostPluginDescription& description, const defrec_host* host,
                                const defrec_plugin** out) noexcept;

}  // namespace defrec
