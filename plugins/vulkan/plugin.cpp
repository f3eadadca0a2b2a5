// The plugin `vulkan`: backends/vulkan behind the plugin ABI, one device for each that the Vulkan loader shows.
#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "backends/vulkan/known_answer.hpp"
#include "backends/vulkan/stages.hpp"
#include "plugins/base/guard.hpp"

namespace defrec {
namespace {

struct PluginInstance {
    const defrec_host* host;
    std::shared_ptr<const vulkan::Driver> driver;  // nullptr: no loader, no devices
    defrec_plugin table{};
};

using StageMaker = std::unique_ptr<vulkan::Stage> (*)(const void* params, vulkan::Device& device);

template <class Params, std::unique_ptr<vulkan::Stage> (*kMake)(const Params&, vulkan::Device&)>
std::unique_ptr<vulkan::Stage> make_stage(const void* params, vulkan::Device& device) {
    return kMake(*static_cast<const Params*>(params), device);
}

// By DEFREC_STAGE_*.
constexpr std::array<StageMaker, DEFREC_STAGE_COUNT_V1> kMakers{
    make_stage<defrec_rectify_params, vulkan::make_rectify>,
    make_stage<defrec_stereo_params, vulkan::make_stereo>,
    make_stage<defrec_orb_params, vulkan::make_orb>,
    make_stage<defrec_match_params, vulkan::make_match>,
    make_stage<defrec_align_params, vulkan::make_align>,
    make_stage<defrec_ransac_params, vulkan::make_ransac>,
    make_stage<defrec_lm_params, vulkan::make_lm>,
    make_stage<defrec_warp_params, vulkan::make_warp>,
};

}  // namespace
}  // namespace defrec

struct defrec_pdevice_ {
    const defrec_host& host;
    defrec::vulkan::Device device;
};
struct defrec_pbuffer_ {
    const defrec_host& host;
    defrec::vulkan::Device& device;
    defrec::vulkan::Buffer buffer;
};
struct defrec_pqueue_ {
    const defrec_host& host;
    defrec::vulkan::Queue queue;
};
struct defrec_pstage_ {
    const defrec_host& host;
    defrec::vulkan::Device& device;
    defrec::vulkan::RecordedStage stage;
};

namespace defrec {
namespace {

void check_range(const vulkan::Buffer& buffer, uint64_t offset, uint64_t size) {
    if (offset > buffer.size() || size > buffer.size() - offset) reject("the range does not lie in the buffer");
}

// ---- stages --------------------------------------------------------------------------------------------------------

using BufferArray = std::array<const vulkan::Buffer*, vulkan::RecordedStage::kMaxBuffers>;

vulkan::Buffers collect(defrec_pbuffer* const* buffers, size_t count, BufferArray& out) {
    if (count > out.size()) reject("too many buffers");
    for (size_t i = 0; i < count; ++i) out[i] = buffers[i] == nullptr ? nullptr : &buffers[i]->buffer;
    return {out.data(), count};
}

template <uint32_t kStage>
defrec_status create_stage(defrec_pdevice* device, const void* params, defrec_pstage** out) {
    return guarded(device->host, [&] {
        *out = new defrec_pstage_{device->host, device->device, {device->device, kMakers[kStage](params, device->device)}};
    });
}

// Makers refuse what the device cannot do; what that takes is made and thrown away.
template <uint32_t kStage>
defrec_status supports_stage(defrec_pdevice* device, const void* params) {
    return guarded(device->host, [&] { kMakers[kStage](params, device->device); });
}

void destroy_stage(defrec_pstage* stage) {
    if (stage == nullptr) return;
    stage->device.settle();
    delete stage;
}

defrec_status prepare_stage(defrec_pstage* stage, defrec_pqueue* queue, defrec_pbuffer* const* in, size_t in_count) {
    return guarded(stage->host, [&] {
        BufferArray inputs;
        stage->stage.prepare(queue->queue, collect(in, in_count, inputs));
    });
}

defrec_status enqueue_stage(defrec_pstage* stage, defrec_pqueue* queue, defrec_pbuffer* const* in, size_t in_count,
                            defrec_pbuffer* const* out, size_t out_count) {
    return guarded(stage->host, [&] {
        BufferArray inputs, outputs;
        stage->stage.enqueue(queue->queue, collect(in, in_count, inputs), collect(out, out_count, outputs));
    });
}

template <size_t... kStages>
constexpr std::array<defrec_stage_table, sizeof...(kStages)> make_stage_tables(std::index_sequence<kStages...>) {
    return {fill_stage_table(kStages, supports_stage<kStages>, create_stage<kStages>, destroy_stage, prepare_stage, enqueue_stage)...};
}
constexpr auto kStageTables = make_stage_tables(std::make_index_sequence<DEFREC_STAGE_COUNT_V1>());

const defrec_stage_table* stage_table(void*, uint32_t stage) { return stage < kStageTables.size() ? &kStageTables[stage] : nullptr; }

// ---- devices, buffers, queues --------------------------------------------------------------------------------------

size_t device_count(void* self) {
    const PluginInstance& instance = *static_cast<PluginInstance*>(self);
    return instance.driver == nullptr ? 0 : instance.driver->devices().size();
}

void check_index(void* self, size_t index) {
    if (index >= device_count(self)) reject("there is no device of that index");
}

defrec_status device_info(void* self, size_t index, defrec_device_info* out) {
    const PluginInstance& instance = *static_cast<PluginInstance*>(self);
    return guarded(*instance.host, [&] {
        check_index(self, index);
        const vulkan::PhysicalDevice& device = instance.driver->devices()[index];
        defrec_device_info info{};
        info.kind = DEFREC_DEVICE_VULKAN;
        info.id = device.id.c_str();
        info.name = device.name.c_str();
        info.driver = device.driver.c_str();
        info.memory_bytes = device.memory_bytes;
        // A device that lacks what the stages need is listed with none, so that nobody wonders where it is.
        info.stages = device.lacks.empty() ? (1u << DEFREC_STAGE_COUNT_V1) - 1 : 0;
        info.features = DEFREC_FEATURE_REPEATABLE;
        if (device.software) info.features |= DEFREC_FEATURE_SOFTWARE;
        info.struct_size = out->struct_size;
        std::memcpy(out, &info, std::min<size_t>(out->struct_size, sizeof info));
    });
}

defrec_status device_open(void* self, size_t index, defrec_pdevice** out) {
    const PluginInstance& instance = *static_cast<PluginInstance*>(self);
    return guarded(*instance.host, [&] {
        check_index(self, index);
        auto device = std::unique_ptr<defrec_pdevice>(new defrec_pdevice_{*instance.host, {instance.driver, index}});
        vulkan::check_known_answers(device->device);
        *out = device.release();
    });
}
void device_close(defrec_pdevice* device) { delete device; }

defrec_status buffer_create(defrec_pdevice* device, uint64_t size, defrec_pbuffer** out) {
    return guarded(device->host, [&] {
        auto buffer = std::make_unique<defrec_pbuffer_>(defrec_pbuffer_{device->host, device->device, {device->device, size}});
        device->device.clear(buffer->buffer);
        *out = buffer.release();
    });
}
void buffer_destroy(defrec_pbuffer* buffer) {
    if (buffer == nullptr) return;
    buffer->device.settle();
    delete buffer;
}

defrec_status queue_create(defrec_pdevice* device, defrec_pqueue** out) {
    return guarded(device->host, [&] { *out = new defrec_pqueue_{device->host, vulkan::Queue(device->device)}; });
}
void queue_destroy(defrec_pqueue* queue) { delete queue; }

defrec_status write_buffer(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, const void* src, uint64_t size) {
    return guarded(queue->host, [&] {
        check_range(buffer->buffer, offset, size);
        queue->queue.write(buffer->buffer, offset, src, size);
    });
}
defrec_status read_buffer(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, void* dst, uint64_t size) {
    return guarded(queue->host, [&] {
        check_range(buffer->buffer, offset, size);
        queue->queue.read(buffer->buffer, offset, dst, size);
    });
}

defrec_status signal_queue(defrec_pqueue* queue, uint64_t* out_value) {
    return guarded(queue->host, [&] { *out_value = queue->queue.signal(); });
}
defrec_status wait_queue(defrec_pqueue* queue, uint64_t value, uint64_t timeout_ns) {
    bool reached = false;
    const defrec_status status = guarded(queue->host, [&] { reached = queue->queue.wait(value, timeout_ns); });
    return status == DEFREC_OK && !reached ? DEFREC_TIMEOUT : status;
}

void shut_down(void* self) { delete static_cast<PluginInstance*>(self); }

std::unique_ptr<PluginInstance> make_instance(const defrec_host* host) {
    auto instance = std::make_unique<PluginInstance>();
    instance->host = host;
    instance->driver = vulkan::Driver::open();
    defrec_plugin& table = instance->table;
    table.struct_size = sizeof table;
    table.abi_minor = DEFREC_PLUGIN_ABI_MINOR;
    table.name = "vulkan";
    table.version = DEFREC_RELEASE;
    table.vendor = "defrec";
    table.self = instance.get();
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
    return instance;
}

}  // namespace
}  // namespace defrec

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL defrec_plugin_entry_v1(const defrec_host* host,
                                                                                const defrec_plugin** out) {
    using namespace defrec;
    if (host == nullptr || out == nullptr) return DEFREC_ERROR_ARGUMENT;
    if (!complete_host(host)) return DEFREC_ERROR_VERSION;
    return guarded(*host, [&] { *out = &make_instance(host).release()->table; });
}
