// Backend cpu as four devices, several_devices:0 to :3. Number 1 cannot be opened; number 3 lacks
// stage warp.
#include <string>

#include "plugins/cpu/makers.hpp"

namespace {
using namespace defrec;

constexpr const char* kIds[] = {"several_devices:0", "several_devices:1", "several_devices:2",
                                "several_devices:3"};
const HostPluginDescription kDescription{
    "several_devices",
    DEFREC_RELEASE,
    "One of several",
    cpu::kMakers,
};

const defrec_plugin* inner = nullptr;  // one context at a time
const defrec_host* messages = nullptr;
defrec_plugin outer;

void wrap_plugin() {
    outer = *inner;
    outer.device_count = [](void*) { return std::size(kIds); };
    outer.device_info = [](void* self, size_t index, defrec_device_info* out) {
        const defrec_status status = inner->device_info(self, 0, out);
        out->id = kIds[index];
        if (index == 3) out->stages &= ~(1u << DEFREC_STAGE_WARP);
        return status;
    };
    outer.device_open = [](void* self, size_t index, defrec_pdevice** out) -> defrec_status {
        if (index != 1) return inner->device_open(self, 0, out);
        messages->error(messages->self, "this card is broken");
        return DEFREC_ERROR_DEVICE_LOST;
    };
}

}  // namespace

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
    messages = host;
    const defrec_status status = enter_host_plugin(kDescription, host, &inner);
    if (status != DEFREC_OK) return status;
    wrap_plugin();
    *out = &outer;
    return DEFREC_OK;
}
