// The tables of a backend in host memory; see host_plugin.hpp.
#include "plugins/base/host_plugin.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <new>
#include <utility>

#include "plugins/base/guard.hpp"

namespace defrec {
struct PluginInstance {
    PluginInstance(const HostPluginDescription& what, const defrec_host* given)
        : description(what), host_table(given), host(given) {}
    const HostPluginDescription& description;
    const defrec_host* host_table;
    Host host;
    defrec_plugin table{};
};
}  // namespace defrec

struct defrec_pdevice_ {
    defrec::PluginInstance& instance;
};
struct defrec_pbuffer_ {
    defrec::PluginInstance& instance;
    void* data;
    uint64_t size;
    bool imported;
};
struct defrec_pqueue_ {
    defrec::PluginInstance& instance;
    std::atomic<uint64_t> signalled{0};
};
struct defrec_pstage_ {
    defrec::PluginInstance& instance;
    std::unique_ptr<defrec::Stage> stage;
};

namespace defrec {
namespace {

constexpr size_t kMaxBuffers = 24;

void check_range(const defrec_pbuffer& buffer, uint64_t offset, uint64_t size) {
    if (offset > buffer.size || size > buffer.size - offset) reject("the range does not lie in the buffer");
}

// ---- stages --------------------------------------------------------------------------------------------------------

template <class Buffer>
std::span<const Buffer> collect(defrec_pbuffer* const* buffers, size_t count, std::array<Buffer, kMaxBuffers>& out) {
    if (count > kMaxBuffers) reject("too many buffers");
    for (size_t i = 0; i < count; ++i)
        out[i] = buffers[i] == nullptr ? Buffer{} : Buffer{buffers[i]->data, buffers[i]->size};
    return {out.data(), count};
}

template <uint32_t kStage>
defrec_status create_stage(defrec_pdevice* device, const void* params, defrec_pstage** out) {
    PluginInstance& instance = device->instance;
    return guarded(*instance.host_table, [&] {
        *out = new defrec_pstage_{instance, instance.description.makers[kStage](params, instance.host)};
    });
}

// The host has checked the parameters, and main memory has no limit of its own.
defrec_status supports_stage(defrec_pdevice*, const void*) { return DEFREC_OK; }

void destroy_stage(defrec_pstage* stage) { delete stage; }

defrec_status prepare_stage(defrec_pstage* stage, defrec_pqueue*, defrec_pbuffer* const* in, size_t in_count) {
    return guarded(*stage->instance.host_table, [&] {
        std::array<InBuffer, kMaxBuffers> inputs;
        stage->stage->prepare(collect(in, in_count, inputs));
    });
}

defrec_status enqueue_stage(defrec_pstage* stage, defrec_pqueue*, defrec_pbuffer* const* in, size_t in_count,
                            defrec_pbuffer* const* out, size_t out_count) {
    return guarded(*stage->instance.host_table, [&] {
        std::array<InBuffer, kMaxBuffers> inputs;
        std::array<OutBuffer, kMaxBuffers> outputs;
        const auto ins = collect(in, in_count, inputs);
        const auto outs = collect(out, out_count, outputs);
        stage->stage->run(ins, outs);
    });
}

template <size_t... kStages>
constexpr std::array<defrec_stage_table, sizeof...(kStages)> make_stage_tables(std::index_sequence<kStages...>) {
    return {fill_stage_table(kStages, supports_stage, create_stage<kStages>, destroy_stage, prepare_stage, enqueue_stage)...};
}
constexpr auto kStageTables = make_stage_tables(std::make_index_sequence<DEFREC_STAGE_COUNT_V1>());

const defrec_stage_table* stage_table(void* self, uint32_t stage) {
    const auto& makers = static_cast<PluginInstance*>(self)->description.makers;
    return stage < makers.size() && makers[stage] != nullptr ? &kStageTables[stage] : nullptr;
}

// ---- devices, buffers, queues --------------------------------------------------------------------------------------

size_t device_count(void*) { return 1; }

defrec_status device_info(void* self, size_t index, defrec_device_info* out) {
    const PluginInstance& instance = *static_cast<PluginInstance*>(self);
    return guarded(*instance.host_table, [&] {
        if (index != 0) reject("there is one device");
        defrec_device_info info{};
        info.kind = DEFREC_DEVICE_CPU;
        info.id = instance.description.name;
        info.name = instance.description.device_name;
        info.driver = instance.description.version;
        info.memory_bytes = static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
        for (uint32_t stage = 0; stage < instance.description.makers.size(); ++stage)
            if (instance.description.makers[stage] != nullptr) info.stages |= 1u << stage;
        info.features = DEFREC_FEATURE_REPEATABLE;
        info.struct_size = out->struct_size;
        std::memcpy(out, &info, std::min<size_t>(out->struct_size, sizeof info));
    });
}

defrec_status device_open(void* self, size_t index, defrec_pdevice** out) {
    PluginInstance& instance = *static_cast<PluginInstance*>(self);
    return guarded(*instance.host_table, [&] {
        if (index != 0) reject("there is one device");
        *out = new defrec_pdevice_{instance};
    });
}
void device_close(defrec_pdevice* device) { delete device; }

defrec_status buffer_create(defrec_pdevice* device, uint64_t size, defrec_pbuffer** out) {
    PluginInstance& instance = device->instance;
    return guarded(*instance.host_table, [&] {
        std::unique_ptr<defrec_pbuffer_> buffer(new defrec_pbuffer_{instance, nullptr, size, false});
        buffer->data = instance.host.allocate(std::max<uint64_t>(size, 1), 64);
        std::memset(buffer->data, 0, size);
        *out = buffer.release();
    });
}
void buffer_destroy(defrec_pbuffer* buffer) {
    if (buffer == nullptr) return;
    if (!buffer->imported) buffer->instance.host.release(buffer->data);
    delete buffer;
}
defrec_status buffer_import(defrec_pdevice* device, uint32_t kind, void* memory, uint64_t size, defrec_pbuffer** out) {
    PluginInstance& instance = device->instance;
    return guarded(*instance.host_table, [&] {
        if (kind != DEFREC_MEMORY_HOST)
            throw StageError(DEFREC_ERROR_UNSUPPORTED, std::string(instance.description.name) + " computes in the processor's memory, kind " +
                                                           std::to_string(DEFREC_MEMORY_HOST) + "; kind " + std::to_string(kind) + " was given");
        const auto address = reinterpret_cast<uintptr_t>(memory);
        if (memory == nullptr || address % 16 != 0) reject("memory is imported from an address that is a multiple of 16");
        if (size == 0 || size > UINTPTR_MAX - address) reject("the size does not fit the address space, or is zero");
        *out = new defrec_pbuffer_{instance, memory, size, true};
    });
}

defrec_status queue_create(defrec_pdevice* device, defrec_pqueue** out) {
    return guarded(*device->instance.host_table, [&] { *out = new defrec_pqueue_{device->instance}; });
}
void queue_destroy(defrec_pqueue* queue) { delete queue; }

defrec_status write_buffer(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, const void* src, uint64_t size) {
    return guarded(*queue->instance.host_table, [&] {
        check_range(*buffer, offset, size);
        if (size != 0) std::memcpy(static_cast<unsigned char*>(buffer->data) + offset, src, size);
    });
}
defrec_status read_buffer(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, void* dst, uint64_t size) {
    return guarded(*queue->instance.host_table, [&] {
        check_range(*buffer, offset, size);
        if (size != 0) std::memcpy(dst, static_cast<const unsigned char*>(buffer->data) + offset, size);
    });
}

defrec_status signal_queue(defrec_pqueue* queue, uint64_t* out_value) {
    *out_value = ++queue->signalled;
    return DEFREC_OK;
}
// All work was done when it was enqueued.
defrec_status wait_queue(defrec_pqueue* queue, uint64_t value, uint64_t) {
    return value <= queue->signalled ? DEFREC_OK : DEFREC_TIMEOUT;
}

void shut_down(void* self) { delete static_cast<PluginInstance*>(self); }

}  // namespace

defrec_status enter_host_plugin(const HostPluginDescription& description, const defrec_host* host,
                                const defrec_plugin** out) noexcept {
    if (host == nullptr || out == nullptr) return DEFREC_ERROR_ARGUMENT;
    if (!complete_host(host)) return DEFREC_ERROR_VERSION;
    auto* instance = new (std::nothrow) PluginInstance(description, host);
    if (instance == nullptr) return DEFREC_ERROR_OUT_OF_MEMORY;
    defrec_plugin& table = instance->table;
    table.struct_size = sizeof table;
    table.abi_minor = DEFREC_PLUGIN_ABI_MINOR;
    table.name = description.name;
    table.version = description.version;
    table.vendor = "defrec";
    table.self = instance;
    table.device_count = device_count;
    table.device_info = device_info;
    table.device_open = device_open;
    table.device_close = device_close;
    table.buffer_create = buffer_create;
    table.buffer_destroy = buffer_destroy;
    table.queue_create = queue_create;
    table.queue_destroy = queue_destroy;
    table.write = write_buffer;
    table.read = read_buffer;
    table.signal = signal_queue;
    table.wait = wait_queue;
    table.stage = stage_table;
    table.shutdown = shut_down;
    table.buffer_import = buffer_import;
    *out = &table;
    return DEFREC_OK;
}

}  // namespace defrec
