// See relay.hpp. Every handle is wrapped, since the functions of a table get nothing else that
// tells which instance is meant.
#include "conformance/relay/relay.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "backends/stages/list.hpp"

namespace {

using namespace defrec::conformance;
using defrec::kMaxStageBuffers;
using Clock = std::chrono::steady_clock;

struct Instance {
    RelayPlan plan;
    const defrec_host* host = nullptr;
    const defrec_plugin* target = nullptr;
    defrec_plugin table{};
    std::array<defrec_stage_table, DEFREC_STAGE_COUNT_V1> stages{};
    std::atomic<uint64_t> jitter_counter{0};
    std::atomic<bool> lost{false};

    // DEFREC_OK: hand the call on.
    defrec_status admit(RelayCall kind, bool counts = true) {
        if (lost) {
            ++plan.counts->after_loss;
            return refuse(DEFREC_ERROR_DEVICE_LOST);
        }
        if (!counts || (plan.failing & kind) == 0) return DEFREC_OK;
        if (++plan.counts->calls != plan.fail_at) return DEFREC_OK;
        if (plan.status == DEFREC_ERROR_DEVICE_LOST) lost = true;
        return refuse(plan.status);
    }

  private:
    defrec_status refuse(defrec_status status) {
        ++plan.counts->failures;
        host->error(host->self, "the relay was told to fail here");
        return status;
    }
};

struct Device {
    Instance* instance;
    defrec_pdevice* target;
};
// Members that a plugin need not have.
bool has_host_alloc(const Instance& instance) { return DEFREC_HAS(instance.target, host_alloc); }
bool has_write_in_place(const Instance& instance) {
    return DEFREC_HAS(instance.target, write_in_place);
}
bool has_buffer_import(const Instance& instance) {
    return DEFREC_HAS(instance.target, buffer_import);
}

struct Queue {
    Instance* instance;
    defrec_pqueue* target;
    std::mutex mutex;
    std::map<uint64_t, Clock::time_point> ready;  // by signal
};
struct Buffer {
    Instance* instance;
    defrec_pbuffer* target;
    uint64_t size;
};
struct Stage {
    Instance* instance;
    defrec_pstage* target;
    const defrec_stage_table* table;
    uint64_t motions = 0;  // of lm
};

Device* device_of(defrec_pdevice* device) { return reinterpret_cast<Device*>(device); }
Queue* queue_of(defrec_pqueue* queue) { return reinterpret_cast<Queue*>(queue); }
Buffer* buffer_of(defrec_pbuffer* buffer) { return reinterpret_cast<Buffer*>(buffer); }
Stage* stage_of(defrec_pstage* stage) { return reinterpret_cast<Stage*>(stage); }

using Targets = std::array<defrec_pbuffer*, kMaxStageBuffers>;
Targets targets_of(defrec_pbuffer* const* buffers, size_t count) {
    Targets targets{};
    for (size_t i = 0; i < count; ++i)
        targets[i] = buffers[i] == nullptr ? nullptr : buffer_of(buffers[i])->target;
    return targets;
}

// ---- the plugin's table -----------------------------------------------------

size_t DEFREC_CALL device_count(void* self) {
    const auto* instance = static_cast<Instance*>(self);
    return instance->target->device_count(instance->target->self);
}

defrec_status DEFREC_CALL device_info(void* self, size_t index, defrec_device_info* out) {
    const auto* instance = static_cast<Instance*>(self);
    return instance->target->device_info(instance->target->self, index, out);
}

defrec_status DEFREC_CALL device_open(void* self, size_t index, defrec_pdevice** out) {
    auto* instance = static_cast<Instance*>(self);
    if (const defrec_status status = instance->admit(kRelayOpen); status != DEFREC_OK)
        return status;
    defrec_pdevice* target = nullptr;
    const defrec_status status =
        instance->target->device_open(instance->target->self, index, &target);
    if (status < 0) return status;
    *out = reinterpret_cast<defrec_pdevice*>(new Device{instance, target});
    ++instance->plan.counts->devices;
    return status;
}

void DEFREC_CALL device_close(defrec_pdevice* handle) {
    Device* device = device_of(handle);
    device->instance->target->device_close(device->target);
    --device->instance->plan.counts->devices;
    delete device;
}

defrec_status DEFREC_CALL buffer_create(defrec_pdevice* handle, uint64_t size,
                                        defrec_pbuffer** out) {
    const Device* device = device_of(handle);
    Instance* instance = device->instance;
    if (const defrec_status status = instance->admit(kRelayCreate); status != DEFREC_OK)
        return status;
    defrec_pbuffer* target = nullptr;
    const defrec_status status = instance->target->buffer_create(device->target, size, &target);
    if (status < 0) return status;
    *out = reinterpret_cast<defrec_pbuffer*>(new Buffer{instance, target, size});
    ++instance->plan.counts->buffers;
    return status;
}

void DEFREC_CALL buffer_destroy(defrec_pbuffer* handle) {
    Buffer* buffer = buffer_of(handle);
    buffer->instance->target->buffer_destroy(buffer->target);
    --buffer->instance->plan.counts->buffers;
    delete buffer;
}

defrec_status DEFREC_CALL queue_create(defrec_pdevice* handle, defrec_pqueue** out) {
    const Device* device = device_of(handle);
    Instance* instance = device->instance;
    if (const defrec_status status = instance->admit(kRelayCreate); status != DEFREC_OK)
        return status;
    defrec_pqueue* target = nullptr;
    const defrec_status status = instance->target->queue_create(device->target, &target);
    if (status < 0) return status;
    *out = reinterpret_cast<defrec_pqueue*>(new Queue{instance, target, {}, {}});
    ++instance->plan.counts->queues;
    return status;
}

void DEFREC_CALL queue_destroy(defrec_pqueue* handle) {
    Queue* queue = queue_of(handle);
    queue->instance->target->queue_destroy(queue->target);
    --queue->instance->plan.counts->queues;
    delete queue;
}

defrec_status DEFREC_CALL write(defrec_pqueue* handle, defrec_pbuffer* buffer, uint64_t offset,
                                const void* src, uint64_t size) {
    const Queue* queue = queue_of(handle);
    if (const defrec_status status = queue->instance->admit(kRelayTransfer); status != DEFREC_OK)
        return status;
    return queue->instance->target->write(queue->target, buffer_of(buffer)->target, offset, src,
                                          size);
}

defrec_status DEFREC_CALL read(defrec_pqueue* handle, defrec_pbuffer* buffer, uint64_t offset,
                               void* dst, uint64_t size) {
    const Queue* queue = queue_of(handle);
    if (const defrec_status status = queue->instance->admit(kRelayTransfer); status != DEFREC_OK)
        return status;
    return queue->instance->target->read(queue->target, buffer_of(buffer)->target, offset, dst,
                                         size);
}

defrec_status DEFREC_CALL signal(defrec_pqueue* handle, uint64_t* out_value) {
    Queue* queue = queue_of(handle);
    if (const defrec_status status = queue->instance->admit(kRelaySignal); status != DEFREC_OK)
        return status;
    const defrec_status status = queue->instance->target->signal(queue->target, out_value);
    if (status >= 0 && queue->instance->plan.delay_ns > 0) {
        const std::lock_guard lock(queue->mutex);
        queue->ready[*out_value] =
            Clock::now() + std::chrono::nanoseconds(queue->instance->plan.delay_ns);
    }
    return status;
}

// What is left of the delay of the point, no less than zero.
std::chrono::nanoseconds left_of_delay(Queue& queue, uint64_t value) {
    const std::lock_guard lock(queue.mutex);
    const auto point = queue.ready.lower_bound(value);
    return point == queue.ready.end()
               ? std::chrono::nanoseconds(0)
               : std::max(std::chrono::nanoseconds(0),
                          std::chrono::nanoseconds(point->second - Clock::now()));
}

defrec_status DEFREC_CALL wait(defrec_pqueue* handle, uint64_t value, uint64_t timeout_ns) {
    Queue* queue = queue_of(handle);
    const bool counts = timeout_ns == UINT64_MAX;
    if (const defrec_status status = queue->instance->admit(kRelayWait, counts);
        status != DEFREC_OK)
        return status;
    const auto left = static_cast<uint64_t>(left_of_delay(*queue, value).count());
    const auto end = Clock::now() + std::chrono::nanoseconds(std::min(left, timeout_ns));
    while (Clock::now() < end) std::this_thread::sleep_until(end);  // Windows may end it early
    if (left > timeout_ns) return DEFREC_TIMEOUT;
    return queue->instance->target->wait(queue->target, value,
                                         timeout_ns == UINT64_MAX ? UINT64_MAX : timeout_ns - left);
}

defrec_status DEFREC_CALL host_alloc(defrec_pdevice* handle, uint64_t size, void** out) {
    const Device* device = device_of(handle);
    Instance* instance = device->instance;
    if (const defrec_status status = instance->admit(kRelayCreate); status != DEFREC_OK)
        return status;
    const defrec_status status = instance->target->host_alloc(device->target, size, out);
    if (status >= 0) ++instance->plan.counts->host_memories;
    return status;
}

void DEFREC_CALL host_free(defrec_pdevice* handle, void* memory) {
    const Device* device = device_of(handle);
    device->instance->target->host_free(device->target, memory);
    --device->instance->plan.counts->host_memories;
}

defrec_status DEFREC_CALL write_in_place(defrec_pqueue* handle, defrec_pbuffer* buffer,
                                         uint64_t offset, const void* src, uint64_t size) {
    const Queue* queue = queue_of(handle);
    if (const defrec_status status = queue->instance->admit(kRelayTransfer); status != DEFREC_OK)
        return status;
    return queue->instance->target->write_in_place(queue->target, buffer_of(buffer)->target, offset,
                                                   src, size);
}

defrec_status DEFREC_CALL buffer_import(defrec_pdevice* handle, uint32_t kind, void* memory,
                                        uint64_t size, defrec_pbuffer** out) {
    const Device* device = device_of(handle);
    Instance* instance = device->instance;
    if (const defrec_status status = instance->admit(kRelayCreate); status != DEFREC_OK)
        return status;
    defrec_pbuffer* target = nullptr;
    const defrec_status status =
        instance->target->buffer_import(device->target, kind, memory, size, &target);
    if (status < 0) return status;
    *out = reinterpret_cast<defrec_pbuffer*>(new Buffer{instance, target, size});
    ++instance->plan.counts->buffers;
    return status;
}

const defrec_stage_table* DEFREC_CALL stage_table(void* self, uint32_t stage) {
    const auto* instance = static_cast<Instance*>(self);
    if (stage >= DEFREC_STAGE_COUNT_V1 || instance->stages[stage].struct_size == 0) return nullptr;
    return &instance->stages[stage];
}

void DEFREC_CALL shutdown(void* self) {
    auto* instance = static_cast<Instance*>(self);
    instance->target->shutdown(instance->target->self);
    --instance->plan.counts->instances;
    delete instance;
}

// ---- the stages' tables -----------------------------------------------------

template <uint32_t kStage>
const defrec_stage_table* target_table(const Instance& instance) {
    return instance.target->stage(instance.target->self, kStage);
}

template <uint32_t kStage>
defrec_status DEFREC_CALL supports(defrec_pdevice* handle, const void* params) {
    const Device* device = device_of(handle);
    return target_table<kStage>(*device->instance)->supports(device->target, params);
}

template <uint32_t kStage>
defrec_status DEFREC_CALL create(defrec_pdevice* handle, const void* params, defrec_pstage** out) {
    const Device* device = device_of(handle);
    Instance* instance = device->instance;
    if (const defrec_status status = instance->admit(kRelayCreate); status != DEFREC_OK)
        return status;
    const defrec_stage_table* table = target_table<kStage>(*instance);
    defrec_pstage* target = nullptr;
    const defrec_status status = table->create(device->target, params, &target);
    if (status < 0) return status;
    const uint64_t motions =
        kStage == DEFREC_STAGE_LM ? static_cast<const defrec_lm_params*>(params)->nodes : 0;
    *out = reinterpret_cast<defrec_pstage*>(new Stage{instance, target, table, motions});
    ++instance->plan.counts->stages;
    return status;
}

void DEFREC_CALL destroy(defrec_pstage* handle) {
    Stage* stage = stage_of(handle);
    stage->table->destroy(stage->target);
    --stage->instance->plan.counts->stages;
    delete stage;
}

defrec_status DEFREC_CALL prepare(defrec_pstage* handle, defrec_pqueue* queue,
                                  defrec_pbuffer* const* in, size_t in_count) {
    const Stage* stage = stage_of(handle);
    if (in_count > kMaxStageBuffers) return DEFREC_ERROR_ARGUMENT;
    if (const defrec_status status = stage->instance->admit(kRelayPrepare); status != DEFREC_OK)
        return status;
    return stage->table->prepare(stage->target, queue_of(queue)->target,
                                 targets_of(in, in_count).data(), in_count);
}

// Uniform in -1..1, a function of seed and counter (SplitMix64's finaliser).
double noise(uint64_t seed, uint64_t counter) {
    uint64_t z = seed * 0xd1342543de82ef95 + counter * 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-52 - 1;
}

// dual = 0.5 * t * real: a shift d of the translation adds 0.5 * d * real (the product of
// quaternions, d being (0, d)).
void shift(defrec_motion& motion, const std::array<double, 3>& d) {
    const float* q = motion.real;
    const double added[4] = {
        -d[0] * q[1] - d[1] * q[2] - d[2] * q[3], d[0] * q[0] + d[1] * q[3] - d[2] * q[2],
        d[1] * q[0] + d[2] * q[1] - d[0] * q[3], d[2] * q[0] + d[0] * q[2] - d[1] * q[1]};
    for (int i = 0; i < 4; ++i)
        motion.dual[i] = static_cast<float>(motion.dual[i] + 0.5 * added[i]);
}

defrec_status jitter(Instance& instance, const Stage& stage, const Queue& queue,
                     const Buffer& buffer) {
    const defrec_plugin& target = *instance.target;
    std::vector<defrec_motion> motions(stage.motions);
    const uint64_t size = motions.size() * sizeof(defrec_motion);
    uint64_t point = 0;
    defrec_status status = target.read(queue.target, buffer.target, 0, motions.data(), size);
    if (status >= 0) status = target.signal(queue.target, &point);
    if (status >= 0) status = target.wait(queue.target, point, UINT64_MAX);
    if (status < 0) return status;
    for (defrec_motion& motion : motions) {
        std::array<double, 3> d;
        for (double& x : d)
            x = instance.plan.jitter_mm *
                noise(instance.plan.jitter_seed, ++instance.jitter_counter);
        shift(motion, d);
    }
    return target.write(queue.target, buffer.target, 0, motions.data(), size);
}

defrec_status DEFREC_CALL enqueue(defrec_pstage* handle, defrec_pqueue* queue,
                                  defrec_pbuffer* const* in, size_t in_count,
                                  defrec_pbuffer* const* out, size_t out_count) {
    const Stage* stage = stage_of(handle);
    Instance& instance = *stage->instance;
    if (std::max(in_count, out_count) > kMaxStageBuffers) return DEFREC_ERROR_ARGUMENT;
    if (const defrec_status status = instance.admit(kRelayEnqueue); status != DEFREC_OK)
        return status;
    const defrec_status status = stage->table->enqueue(
        stage->target, queue_of(queue)->target, targets_of(in, in_count).data(), in_count,
        targets_of(out, out_count).data(), out_count);
    if (status < 0 || instance.plan.jitter_mm <= 0 || stage->motions == 0) return status;
    return jitter(instance, *stage, *queue_of(queue), *buffer_of(out[0]));
}

template <uint32_t kStage>
void fill_stage(Instance& instance) {
    const defrec_stage_table* target = target_table<kStage>(instance);
    if (target == nullptr) return;
    defrec_stage_table& table = instance.stages[kStage];
    table.struct_size = sizeof table;
    table.stage = kStage;
    table.stage_version = target->stage_version;
    table.supports = supports<kStage>;
    table.create = create<kStage>;
    table.destroy = destroy;
    table.prepare = target->prepare == nullptr ? nullptr : prepare;
    table.enqueue = enqueue;
}

template <uint32_t... kStages>
void fill_stages(Instance& instance, std::integer_sequence<uint32_t, kStages...>) {
    (fill_stage<kStages>(instance), ...);
}

// The library may enter a plugin on a thread of its own.
std::mutex armed_mutex;
std::optional<RelayPlan> armed;

std::optional<RelayPlan> take_armed() {
    const std::lock_guard lock(armed_mutex);
    return std::exchange(armed, std::nullopt);
}

}  // namespace

extern "C" DEFREC_PLUGIN_EXPORT void defrec_relay_arm(const RelayPlan& plan) {
    const std::lock_guard lock(armed_mutex);
    armed = plan;
}

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
    const std::optional<RelayPlan> plan = take_armed();
    if (!plan) {
        host->error(
            host->self,
            "the relay is a part of the conformance suite, and nothing told it what to relay");
        return DEFREC_ERROR_UNSUPPORTED;
    }
    auto instance = std::make_unique<Instance>();
    instance->plan = *plan;
    instance->host = host;
    const defrec_status status = instance->plan.target(host, &instance->target);
    if (status < 0) return status;
    instance->table = {sizeof(defrec_plugin),
                       DEFREC_PLUGIN_ABI_MINOR,
                       "relay",
                       DEFREC_RELEASE,
                       "defrec",
                       instance.get(),
                       device_count,
                       device_info,
                       device_open,
                       device_close,
                       buffer_create,
                       buffer_destroy,
                       queue_create,
                       queue_destroy,
                       write,
                       read,
                       signal,
                       wait,
                       stage_table,
                       shutdown,
                       has_host_alloc(*instance) ? host_alloc : nullptr,
                       has_host_alloc(*instance) ? host_free : nullptr,
                       has_write_in_place(*instance) ? write_in_place : nullptr,
                       has_buffer_import(*instance) ? buffer_import : nullptr};
    fill_stages(*instance, std::make_integer_sequence<uint32_t, DEFREC_STAGE_COUNT_V1>());
    ++instance->plan.counts->instances;
    *out = &instance.release()->table;
    return DEFREC_OK;
}
