// See host.hpp.
#include "sdk/plugin/host.hpp"

#include "sdk/base/os/kept_floating_point.hpp"
#include "sdk/base/util/status.hpp"
#include "sdk/base/util/text_buffer.hpp"

namespace defrec {
namespace {

thread_local TextBuffer<512> plugin_text;

const Services& services(void* self) { return *static_cast<PluginHostData*>(self)->services; }

void host_log(void* self, int32_t level, const char* text) {
    services(self).log(level, static_cast<PluginHostData*>(self)->source,
                       text == nullptr ? "" : text);
}
void host_error(void*, const char* text) { plugin_text.set(text == nullptr ? "" : text); }
void* host_alloc(void* self, size_t size, size_t alignment) {
    return services(self).allocate(size, alignment);
}
void host_free(void* self, void* memory) { services(self).release(memory); }
void host_parallel_for(void* self, size_t count, void (*body)(void*, size_t), void* arg) {
    struct Bodies {
        void (*body)(void*, size_t);
        void* arg;
    } bodies{body, arg};
    // On threads of the host's, which go on to other work.
    services(self).parallel_for_raw(
        count,
        [](void* given, size_t index) {
            const KeptFloatingPoint mode;
            const auto& [run, with] = *static_cast<const Bodies*>(given);
            run(with, index);
        },
        &bodies);
}
uint32_t host_concurrency(void* self) { return services(self).concurrency(); }

}  // namespace

defrec_host make_plugin_host(PluginHostData& self) {
    defrec_host host{};
    host.struct_size = sizeof host;
    host.abi_minor = DEFREC_PLUGIN_ABI_MINOR;
    host.self = &self;
    host.log = host_log;
    host.error = host_error;
    host.alloc = host_alloc;
    host.free = host_free;
    host.parallel_for = host_parallel_for;
    host.concurrency = host_concurrency;
    return host;
}

void clear_plugin_error() noexcept { plugin_text.set(""); }

std::string plugin_error_or_name(defrec_status status) {
    return plugin_text.empty() ? status_name(status) : plugin_text.text();
}

}  // namespace defrec
