// The plugin `example`: one device in host memory that offers the stage rectify. Everything between
// the plugin ABI (defrec_plugin.h) and rectify.cpp is here: the entry, the plugin's table, the
// stage's table, buffers, queues.
//
// A queue here computes when it is given work, so all work is done by the time of a signal. A
// device that works on its own queues the work instead, and wait blocks until it has come to that
// point.
#include <defrec_plugin.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <exception>
#include <memory>
#include <new>

#include "rectify.hpp"

#ifndef EXAMPLE_VERSION
#error "EXAMPLE_VERSION: the plugin's version, as in its manifest"
#endif

namespace {

// What one call of the entry made. There is no global state: two contexts in one process have two
// of these.
struct Instance {
    const defrec_host* host;
    defrec_plugin table;
};

// What stops a call: guarded() turns it into a status, and its text into the host's last error.
struct Failure {
    defrec_status status;
    const char* text;
};

// Memory of the host's allocator: an application that gives its own sees all that its frames take.
class HostMemory {
  public:
    HostMemory(const defrec_host& host, uint64_t size)
        : host_(host),
          data_(static_cast<uint8_t*>(
              host.alloc(host.self, size_t(std::max<uint64_t>(size, 1)), 64))) {
        if (data_ == nullptr) throw std::bad_alloc();
        std::memset(data_, 0, size_t(size));
    }
    ~HostMemory() { host_.free(host_.self, data_); }
    HostMemory(const HostMemory&) = delete;
    HostMemory& operator=(const HostMemory&) = delete;
    uint8_t* data() const { return data_; }

  private:
    const defrec_host& host_;
    uint8_t* data_;
};

// Every function below that can fail runs inside of this: no exception crosses the border, and each
// failure has its error message.
template <class Body>
defrec_status guarded(const Instance& instance, Body&& body) noexcept {
    const defrec_host& host = *instance.host;
    try {
        body();
        return DEFREC_OK;
    } catch (const Failure& failure) {
        host.error(host.self, failure.text);
        return failure.status;
    } catch (const std::bad_alloc&) {
        host.error(host.self, "out of memory");
        return DEFREC_ERROR_OUT_OF_MEMORY;
    } catch (const std::exception& error) {
        host.error(host.self, error.what());
        return DEFREC_ERROR_INTERNAL;
    } catch (...) {
        host.error(host.self, "an exception of unknown type");
        return DEFREC_ERROR_INTERNAL;
    }
}

}  // namespace

// The ABI's opaque types are the plugin's own to define.
struct defrec_pdevice_ {
    const Instance& instance;
};
struct defrec_pbuffer_ {
    defrec_pbuffer_(const Instance& of, uint64_t bytes)
        : instance(of), size(bytes), memory(*of.host, bytes) {}
    const Instance& instance;
    uint64_t size;
    HostMemory memory;
};
struct defrec_pqueue_ {
    const Instance& instance;
    std::atomic<uint64_t> signalled;
};
struct defrec_pstage_ {
    defrec_pstage_(const Instance& of, const defrec_rectify_params& given)
        : instance(of), params(given), scratch(*of.host, example::rectify_scratch_bytes(given)) {}
    const Instance& instance;
    defrec_rectify_params params;  // a copy: the host's lives no longer than the call
    HostMemory scratch;            // allocated here, because enqueue must not
};

namespace {

// ---- the stage --------------------------------------------------------------

void check_params(const void* params) {
    const example::Verdict verdict =
        example::check_rectify(*static_cast<const defrec_rectify_params*>(params));
    if (verdict.status != DEFREC_OK) throw Failure{verdict.status, verdict.text};
}

defrec_status rectify_supports(defrec_pdevice* device, const void* params) {
    return guarded(device->instance, [&] { check_params(params); });
}

defrec_status rectify_create(defrec_pdevice* device, const void* params, defrec_pstage** out) {
    return guarded(device->instance, [&] {
        check_params(params);
        *out = new defrec_pstage_(device->instance,
                                  *static_cast<const defrec_rectify_params*>(params));
    });
}

void rectify_destroy(defrec_pstage* stage) { delete stage; }

// The memory of buffer `index`; nullptr for an optional one that was not given.
uint8_t* take(defrec_pbuffer* const* buffers, size_t count, size_t index, bool required,
              uint64_t bytes) {
    if (index >= count || buffers[index] == nullptr) {
        if (required) throw Failure{DEFREC_ERROR_ARGUMENT, "rectify: a required buffer is missing"};
        return nullptr;
    }
    if (buffers[index]->size < bytes)
        throw Failure{DEFREC_ERROR_ARGUMENT, "rectify: a buffer is smaller than its definition"};
    return buffers[index]->memory.data();
}

defrec_status rectify_enqueue(defrec_pstage* stage, defrec_pqueue*, defrec_pbuffer* const* in,
                              size_t in_count, defrec_pbuffer* const* out, size_t out_count) {
    return guarded(stage->instance, [&] {
        const defrec_rectify_params& p = stage->params;
        if (in_count > 3 || out_count > 2)
            throw Failure{DEFREC_ERROR_ARGUMENT, "rectify: 1 to 3 inputs and 2 outputs expected"};
        example::RectifyImages images;
        images.source = take(in, in_count, 0, true, example::rectify_source_bytes(p));
        images.map = reinterpret_cast<const int32_t*>(
            take(in, in_count, 1, false, example::rectify_map_bytes(p)));
        images.ignore = take(in, in_count, 2, false, example::rectify_ignore_bytes(p));
        images.gray = take(out, out_count, 0, true, example::rectify_result_bytes(p));
        images.mask = take(out, out_count, 1, true, example::rectify_result_bytes(p));
        if (images.map == nullptr && (p.width != p.source_width || p.height != p.source_height))
            throw Failure{DEFREC_ERROR_ARGUMENT,
                          "rectify: without a map the result must have the source's size"};
        example::rectify(p, *stage->instance.host, images, stage->scratch.data());
    });
}

const defrec_stage_table* stage_table(void*, uint32_t stage) {
    static const defrec_stage_table rectify = [] {
        defrec_stage_table table{};
        table.struct_size = sizeof table;
        table.stage = DEFREC_STAGE_RECTIFY;
        table.stage_version = 1;
        table.supports = rectify_supports;
        table.create = rectify_create;
        table.destroy = rectify_destroy;
        table.prepare = nullptr;  // rectify has nothing that stays the same from run to run
        table.enqueue = rectify_enqueue;
        return table;
    }();
    return stage == DEFREC_STAGE_RECTIFY ? &rectify : nullptr;
}

// ---- the device -------------------------------------------------------------

// A plugin for hardware says 0 here when its driver is missing; being loaded without one is no
// error.
size_t device_count(void*) { return 1; }

void check_index(size_t index) {
    if (index != 0) throw Failure{DEFREC_ERROR_ARGUMENT, "there is one device"};
}

defrec_status device_info(void* self, size_t index, defrec_device_info* out) {
    return guarded(*static_cast<Instance*>(self), [&] {
        check_index(index);
        defrec_device_info info{};
        info.kind = DEFREC_DEVICE_CPU;
        info.id = "example";  // unique among all devices of all plugins, the same in every run
        info.name = "Example device";
        info.driver = EXAMPLE_VERSION;
        info.memory_bytes = uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
        info.stages = 1u << DEFREC_STAGE_RECTIFY;
        info.features = DEFREC_FEATURE_REPEATABLE;  // the same input gives the same bits; leave it
                                                    // out if not so
        // The host's struct may be older or newer than this plugin: only what both know is written.
        info.struct_size = out->struct_size;
        std::memcpy(out, &info, std::min<size_t>(out->struct_size, sizeof info));
    });
}

defrec_status device_open(void* self, size_t index, defrec_pdevice** out) {
    const Instance& instance = *static_cast<Instance*>(self);
    return guarded(instance, [&] {
        check_index(index);
        *out = new defrec_pdevice_{instance};
    });
}
void device_close(defrec_pdevice* device) { delete device; }

// ---- buffers and queues -----------------------------------------------------

defrec_status buffer_create(defrec_pdevice* device, uint64_t size, defrec_pbuffer** out) {
    return guarded(device->instance, [&] { *out = new defrec_pbuffer_(device->instance, size); });
}
void buffer_destroy(defrec_pbuffer* buffer) { delete buffer; }

defrec_status queue_create(defrec_pdevice* device, defrec_pqueue** out) {
    return guarded(device->instance, [&] { *out = new defrec_pqueue_{device->instance, {0}}; });
}
void queue_destroy(defrec_pqueue* queue) { delete queue; }

void check_range(const defrec_pbuffer& buffer, uint64_t offset, uint64_t size) {
    // offset + size could wrap round.
    if (offset > buffer.size || size > buffer.size - offset)
        throw Failure{DEFREC_ERROR_ARGUMENT, "the range does not lie in the buffer"};
}

defrec_status write_buffer(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset,
                           const void* src, uint64_t size) {
    return guarded(queue->instance, [&] {
        check_range(*buffer, offset, size);
        if (size != 0) std::memcpy(buffer->memory.data() + offset, src, size_t(size));
    });
}

defrec_status read_buffer(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, void* dst,
                          uint64_t size) {
    return guarded(queue->instance, [&] {
        check_range(*buffer, offset, size);
        if (size != 0) std::memcpy(dst, buffer->memory.data() + offset, size_t(size));
    });
}

defrec_status signal_queue(defrec_pqueue* queue, uint64_t* out_value) {
    *out_value = ++queue->signalled;
    return DEFREC_OK;
}
defrec_status wait_queue(defrec_pqueue* queue, uint64_t value, uint64_t /*timeout_ns*/) {
    return value <= queue->signalled ? DEFREC_OK : DEFREC_TIMEOUT;
}

// The last call. A plugin with threads joins them here.
void shut_down(void* self) { delete static_cast<Instance*>(self); }

}  // namespace

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
    if (host == nullptr || out == nullptr) return DEFREC_ERROR_ARGUMENT;
    // A member that a later minor version appended may be missing in an older host's table. All
    // of 1.0 is needed here; concurrency is the last of them.
    if (!DEFREC_HAS(host, concurrency) || !DEFREC_HAS(host, error) || !DEFREC_HAS(host, alloc) ||
        !DEFREC_HAS(host, free) || !DEFREC_HAS(host, parallel_for))
        return DEFREC_ERROR_VERSION;
    auto* instance = new (std::nothrow) Instance{host, {}};
    if (instance == nullptr) {
        host->error(host->self, "out of memory");
        return DEFREC_ERROR_OUT_OF_MEMORY;
    }
    defrec_plugin& table = instance->table;
    table.struct_size = sizeof table;
    table.abi_minor = DEFREC_PLUGIN_ABI_MINOR;
    table.name = "example";  // as in the manifest
    table.version = EXAMPLE_VERSION;
    table.vendor = "Your name here";
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
    *out = &table;
    return DEFREC_OK;
}
