// Puts a backend that works in host memory behind the plugin ABI: tables, buffers, queues that compute on enqueue, and the
// barrier that turns exceptions into statuses. Knows nothing of any stage but its number.
#pragma once
#include <array>
#include <memory>

#include "backends/shared/stage.hpp"

namespace defrec {

// Makes a stage from its complete parameters; params points to the defrec_*_params that belong to it.
using StageMaker = std::unique_ptr<Stage> (*)(const void* params, const Host& host);

struct HostPluginDescription {
    const char* name;         // also the id of its one device
    const char* version;
    const char* device_name;  // for people
    std::array<StageMaker, DEFREC_STAGE_COUNT_V1> makers;  // by DEFREC_STAGE_*; nullptr: not offered
};

// The body of defrec_plugin_entry_v1. Every call makes an independent instance. description lives as long as the process.
defrec_status enter_host_plugin(const HostPluginDescription& description, const defrec_host* host,
                                const defrec_plugin** out) noexcept;

// The StageMaker for a backend's maker function.
template <class Params, std::unique_ptr<Stage> (*kMake)(const Params&, const Host&)>
std::unique_ptr<Stage> make_stage(const void* params, const Host& host) {
    return kMake(*static_cast<const Params*>(params), host);
}

}  // namespace defrec
