// See frame.hpp. FAULT_NAME: the plugin's name.
#include "plugins/faulty/frame.hpp"

#include <list>
#include <mutex>

namespace defrec::faulty {

Tables good;

namespace {

Tables changed;
HostPluginDescription description{
    FAULT_NAME,
    DEFREC_RELEASE,
    "Faulty: " FAULT_NAME,
    cpu::kMakers,
};

const defrec_stage_table* changed_stage(void*, uint32_t stage) {
    return stage < changed.stages.size() ? &changed.stages[stage] : nullptr;
}

void keep_tables(const defrec_plugin& table) {
    good.plugin = table;
    for (uint32_t stage = 0; stage < good.stages.size(); ++stage)
        good.stages[stage] = *table.stage(table.self, stage);
    changed = good;
    changed.plugin.stage = changed_stage;
    if (fault.change != nullptr) fault.change(changed);
}

// The host's table as the fault wants it; lives as long as the process, for no instance is told
// when its own may go.
const defrec_host* changed_host(const defrec_host* host) {
    static std::list<defrec_host> hosts;
    if (fault.change_host == nullptr || host == nullptr) return host;
    fault.change_host(hosts.emplace_back(*host));
    return &hosts.back();
}

}  // namespace
}  // namespace defrec::faulty

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
    using namespace defrec::faulty;
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    if (fault.maker != nullptr) description.makers[fault.stage] = fault.maker;
    const defrec_plugin* table = nullptr;
    const defrec_status status = defrec::enter_host_plugin(description, changed_host(host),
                                                           out == nullptr ? nullptr : &table);
    if (status != DEFREC_OK) return status;
    if (good.plugin.struct_size == 0) keep_tables(*table);
    auto& own = const_cast<defrec_plugin&>(*table);  // plugins/base makes one for each instance
    void* self = own.self;
    own = changed.plugin;
    own.self = self;
    *out = table;
    return DEFREC_OK;
}
