// Puts a backend behind the plugin ABI: fills the plugin's table and those of its stages, every
// entry behind the barrier of guard.hpp.
#pragma once
#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>

#include "backends/stages/list.hpp"
#include "plugins/base/guard.hpp"

// What the host sees of a plugin's objects: where their failures are told. PluginOf derives the
// rest.
struct defrec_pdevice_ {
    const defrec_host& host;
};
struct defrec_pbuffer_ {
    const defrec_host& host;
};
struct defrec_pqueue_ {
    const defrec_host& host;
};
struct defrec_pstage_ {
    const defrec_host& host;
};

namespace defrec {

// How a plugin makes a stage: from its complete parameters (the defrec_*_params that belong to it)
// and what its backend wants beside them.
template <class Made, class Context>
using MakerOf = std::unique_ptr<Made> (*)(const void* params, Context& context);

// The stage that parameters belong to, as ::value.
template <class Params>
struct StageOf;
#define DEFREC_STAGE_OF(name, NAME)        \
    template <>                            \
    struct StageOf<defrec_##name##_params> \
        : std::integral_constant<uint32_t, DEFREC_STAGE_##NAME> {};
DEFREC_STAGES(DEFREC_STAGE_OF, DEFREC_NOTHING)
#undef DEFREC_STAGE_OF

namespace detail {
template <class Function>
struct Making;
template <class Made, class Params, class Context>
struct Making<std::unique_ptr<Made> (*)(const Params&, Context&)> {
    using Maker = MakerOf<Made, Context>;
    static constexpr uint32_t kStage = StageOf<Params>::value;
    template <auto kMake>
    static std::unique_ptr<Made> make(const void* params, Context& context) {
        return kMake(*static_cast<const Params*>(params), context);
    }
};
}  // namespace detail
// A backend's maker functions as MakerOf, each at its DEFREC_STAGE_*, whatever their order; nullptr
// where there is none.
template <auto kFirst, auto... kOthers>
consteval auto makers_of() {
    using Maker = typename detail::Making<decltype(kFirst)>::Maker;
    std::array<Maker, DEFREC_STAGE_COUNT_V1> makers{};
    const auto add = [&](uint32_t stage, Maker maker) {
        if (makers[stage] != nullptr) throw "two functions make the same stage";
        makers[stage] = maker;
    };
    add(detail::Making<decltype(kFirst)>::kStage,
        detail::Making<decltype(kFirst)>::template make<kFirst>);
    (add(detail::Making<decltype(kOthers)>::kStage,
         detail::Making<decltype(kOthers)>::template make<kOthers>),
     ...);
    return makers;
}

// A backend throws StageError and has
// - Device: settle() noexcept; after it, buffers and stages may be destroyed
// - Buffer: size()
// - Queue: Queue(Device&), write, read, signal, wait, as those of backends/vulkan/queue.hpp
// - Stage: prepare(Queue&, in), enqueue(Queue&, in, out); spans of const Buffer*, nullptr: not
//   given
// - name(), version(), device_count(), offers(stage)
// - describe(index, defrec_device_info&): sets what is the device's own; stages: those offered, of
//   which it may take some away
// - open(index): a unique_ptr<Device>
// - make_buffer(Device&, size): of zeros
// - make_stage(Device&, stage, params)
// - check_support(Device&, stage, params): throws what make_stage would
// and of these what it can:
// - allocate_host(Device&, size), release_host(Device&, memory) noexcept
// - import_buffer(Device&, kind, memory, size)
// - Queue::write_in_place, as write
template <class Backend>
class PluginOf {
  public:
    template <class... Given>
    explicit PluginOf(const defrec_host& host, Given&&... given)
        : host_(host), backend_(std::forward<Given>(given)...) {
        fill_table();
    }
    PluginOf(const PluginOf&) = delete;
    PluginOf& operator=(const PluginOf&) = delete;

    const defrec_plugin& table() const { return table_; }

  private:
    struct Device : defrec_pdevice_ {
        Backend& backend;
        std::unique_ptr<typename Backend::Device> device;
    };
    struct Buffer : defrec_pbuffer_ {
        typename Backend::Device& device;
        typename Backend::Buffer buffer;
    };
    struct Queue : defrec_pqueue_ {
        typename Backend::Queue queue;
    };
    struct Stage : defrec_pstage_ {
        typename Backend::Device& device;
        typename Backend::Stage stage;
    };
    static PluginOf& of(void* self) { return *static_cast<PluginOf*>(self); }
    static Device& of(defrec_pdevice* device) { return *static_cast<Device*>(device); }
    static Buffer& of(defrec_pbuffer* buffer) { return *static_cast<Buffer*>(buffer); }
    static Queue& of(defrec_pqueue* queue) { return *static_cast<Queue*>(queue); }
    static Stage& of(defrec_pstage* stage) { return *static_cast<Stage*>(stage); }

    // ---- devices ------------------------------------------------------------

    static size_t device_count(void* self) { return of(self).backend_.device_count(); }

    void check_index(size_t index) const {
        if (index >= backend_.device_count()) reject("there is no device of that index");
    }

    static defrec_status device_info(void* self, size_t index, defrec_device_info* out) {
        return guarded(of(self).host_, [&] {
            of(self).check_index(index);
            defrec_device_info info{};
            for (uint32_t stage = 0; stage < DEFREC_STAGE_COUNT_V1; ++stage)
                if (of(self).backend_.offers(stage)) info.stages |= 1u << stage;
            of(self).backend_.describe(index, info);
            info.struct_size = out->struct_size;
            std::memcpy(out, &info, std::min<size_t>(out->struct_size, sizeof info));
        });
    }

    static defrec_status device_open(void* self, size_t index, defrec_pdevice** out) {
        return guarded(of(self).host_, [&] {
            of(self).check_index(index);
            *out = new Device{{of(self).host_}, of(self).backend_, of(self).backend_.open(index)};
        });
    }
    static void device_close(defrec_pdevice* device) { delete static_cast<Device*>(device); }

    // ---- buffers ------------------------------------------------------------

    static defrec_status buffer_create(defrec_pdevice* device, uint64_t size,
                                       defrec_pbuffer** out) {
        return guarded(device->host, [&] {
            auto& on = *of(device).device;
            *out = new Buffer{{device->host}, on, of(device).backend.make_buffer(on, size)};
        });
    }
    static defrec_status buffer_import(defrec_pdevice* device, uint32_t kind, void* memory,
                                       uint64_t size, defrec_pbuffer** out) {
        return guarded(device->host, [&] {
            const auto address = reinterpret_cast<uintptr_t>(memory);
            if (memory == nullptr || address % 16 != 0)
                reject("memory is imported from an address that is a multiple of 16");
            if (size == 0 || size > UINTPTR_MAX - address)
                reject("the size does not fit the address space, or is zero");
            auto& on = *of(device).device;
            *out = new Buffer{
                {device->host}, on, of(device).backend.import_buffer(on, kind, memory, size)};
        });
    }
    static void buffer_destroy(defrec_pbuffer* buffer) {
        if (buffer == nullptr) return;
        of(buffer).device.settle();
        delete &of(buffer);
    }

    static defrec_status host_alloc(defrec_pdevice* device, uint64_t size, void** out) {
        return guarded(device->host,
                       [&] { *out = of(device).backend.allocate_host(*of(device).device, size); });
    }
    static void host_free(defrec_pdevice* device, void* memory) {
        of(device).backend.release_host(*of(device).device, memory);
    }

    // ---- queues -------------------------------------------------------------

    static defrec_status queue_create(defrec_pdevice* device, defrec_pqueue** out) {
        return guarded(device->host, [&] {
            *out = new Queue{{device->host}, typename Backend::Queue(*of(device).device)};
        });
    }
    static void queue_destroy(defrec_pqueue* queue) { delete static_cast<Queue*>(queue); }

    static const auto& in_range(defrec_pbuffer* buffer, uint64_t offset, uint64_t size) {
        const auto& range = of(buffer).buffer;
        if (offset > range.size() || size > range.size() - offset)
            reject("the range does not lie in the buffer");
        return range;
    }
    static defrec_status write(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset,
                               const void* src, uint64_t size) {
        return guarded(queue->host, [&] {
            of(queue).queue.write(in_range(buffer, offset, size), offset, src, size);
        });
    }
    static defrec_status write_in_place(defrec_pqueue* queue, defrec_pbuffer* buffer,
                                        uint64_t offset, const void* src, uint64_t size) {
        return guarded(queue->host, [&] {
            of(queue).queue.write_in_place(in_range(buffer, offset, size), offset, src, size);
        });
    }
    static defrec_status read(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset,
                              void* dst, uint64_t size) {
        return guarded(queue->host, [&] {
            of(queue).queue.read(in_range(buffer, offset, size), offset, dst, size);
        });
    }

    static defrec_status signal(defrec_pqueue* queue, uint64_t* out_value) {
        return guarded(queue->host, [&] { *out_value = of(queue).queue.signal(); });
    }
    static defrec_status wait(defrec_pqueue* queue, uint64_t value, uint64_t timeout_ns) {
        bool reached = false;
        const defrec_status status =
            guarded(queue->host, [&] { reached = of(queue).queue.wait(value, timeout_ns); });
        return status == DEFREC_OK && !reached ? DEFREC_TIMEOUT : status;
    }

    // ---- stages -------------------------------------------------------------

    using Buffers = std::span<const typename Backend::Buffer* const>;
    using BufferArray = std::array<const typename Backend::Buffer*, kMaxStageBuffers>;

    static Buffers collect(defrec_pbuffer* const* buffers, size_t count, BufferArray& out) {
        if (count > out.size()) reject("too many buffers");
        for (size_t i = 0; i < count; ++i)
            out[i] = buffers[i] == nullptr ? nullptr : &of(buffers[i]).buffer;
        return {out.data(), count};
    }

    template <uint32_t kStage>
    static defrec_status supports(defrec_pdevice* device, const void* params) {
        return guarded(device->host, [&] {
            of(device).backend.check_support(*of(device).device, kStage, params);
        });
    }
    template <uint32_t kStage>
    static defrec_status create(defrec_pdevice* device, const void* params, defrec_pstage** out) {
        return guarded(device->host, [&] {
            auto& on = *of(device).device;
            *out = new Stage{{device->host}, on, of(device).backend.make_stage(on, kStage, params)};
        });
    }
    static void destroy(defrec_pstage* stage) {
        if (stage == nullptr) return;
        of(stage).device.settle();
        delete &of(stage);
    }

    static defrec_status prepare(defrec_pstage* stage, defrec_pqueue* queue,
                                 defrec_pbuffer* const* in, size_t in_count) {
        return guarded(stage->host, [&] {
            BufferArray inputs;
            of(stage).stage.prepare(of(queue).queue, collect(in, in_count, inputs));
        });
    }
    static defrec_status enqueue(defrec_pstage* stage, defrec_pqueue* queue,
                                 defrec_pbuffer* const* in, size_t in_count,
                                 defrec_pbuffer* const* out, size_t out_count) {
        return guarded(stage->host, [&] {
            BufferArray inputs, outputs;
            of(stage).stage.enqueue(of(queue).queue, collect(in, in_count, inputs),
                                    collect(out, out_count, outputs));
        });
    }

    template <size_t... kStages>
    static constexpr std::array<defrec_stage_table, sizeof...(kStages)> make_stage_tables(
        std::index_sequence<kStages...>) {
        return {fill_stage_table(kStages, supports<kStages>, create<kStages>, destroy, prepare,
                                 enqueue)...};
    }
    static const defrec_stage_table* stage(void* self, uint32_t stage) {
        static constexpr auto kTables =
            make_stage_tables(std::make_index_sequence<DEFREC_STAGE_COUNT_V1>());
        return stage < kTables.size() && of(self).backend_.offers(stage) ? &kTables[stage]
                                                                         : nullptr;
    }

    // ---- the plugin ---------------------------------------------------------

    static void shutdown(void* self) { delete &of(self); }

    static constexpr bool kAllocatesHost =
        requires(Backend & backend, typename Backend::Device& device) {
        backend.release_host(device, backend.allocate_host(device, 1));
    };
    static constexpr bool kImports = requires(Backend & backend, typename Backend::Device& device) {
        backend.import_buffer(device, 0u, nullptr, uint64_t{0});
    };
    static constexpr bool kWritesInPlace =
        requires(typename Backend::Queue & queue, const typename Backend::Buffer& buffer) {
        queue.write_in_place(buffer, 0, nullptr, 0);
    };

    void fill_table() {
        table_.struct_size = sizeof table_;
        table_.abi_minor = DEFREC_PLUGIN_ABI_MINOR;
        table_.name = backend_.name();
        table_.version = backend_.version();
        table_.vendor = "defrec";
        table_.self = this;
        table_.device_count = device_count;
        table_.device_info = device_info;
        table_.device_open = device_open;
        table_.device_close = device_close;
        table_.buffer_create = buffer_create;
        table_.buffer_destroy = buffer_destroy;
        table_.queue_create = queue_create;
        table_.queue_destroy = queue_destroy;
        table_.write = write;
        table_.read = read;
        table_.signal = signal;
        table_.wait = wait;
        table_.stage = stage;
        table_.shutdown = shutdown;
        if constexpr (kAllocatesHost) {
            table_.host_alloc = host_alloc;
            table_.host_free = host_free;
        }
        if constexpr (kWritesInPlace) table_.write_in_place = write_in_place;
        if constexpr (kImports) table_.buffer_import = buffer_import;
    }

    const defrec_host& host_;
    Backend backend_;
    defrec_plugin table_{};
};

// The body of defrec_plugin_entry_v1. Every call makes an independent backend from what is given.
template <class Backend, class... Given>
defrec_status enter_plugin(const defrec_host* host, const defrec_plugin** out,
                           Given&&... given) noexcept {
    if (host == nullptr || out == nullptr) return DEFREC_ERROR_ARGUMENT;
    if (!complete_host(host)) return DEFREC_ERROR_VERSION;
    return guarded(*host, [&] {
        // NOLINTNEXTLINE(bugprone-unhandled-exception-at-new): guarded catches it
        *out = &(new PluginOf<Backend>(*host, std::forward<Given>(given)...))->table();
    });
}

}  // namespace defrec
