// The plugin tables as C++: an opened device, its queues, buffers and stages, destroyed in the
// right order. Every failure is an Error with the plugin's own error message. A handle here keeps
// its device open, a device its plugin.
#pragma once
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "backends/stages/list.hpp"
#include "include/defrec_plugin.h"
#include "sdk/base/os/kept_floating_point.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/device/device_watch.hpp"

namespace defrec {

class LoadedPlugin;  // sdk/plugin/loader.hpp
class Services;      // services.hpp

class Device {
  public:
    // index: in the plugin's devices(). watch: told of every call; nullptr: none.
    Device(std::shared_ptr<const LoadedPlugin> plugin, size_t index,
           std::shared_ptr<DeviceWatch> watch = nullptr);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    const std::string& id() const { return id_; }
    uint32_t stages() const { return stages_; }  // bit 1 << DEFREC_STAGE_*
    const defrec_plugin& table() const { return *table_; }
    defrec_pdevice* get() const { return device_; }
    const Services& services() const;
    // Whether HostMemory is the plugin's own: the device is another one than the processor.
    bool has_host_memory() const;
    // Whether copies end when they are asked for, out of memory like any other: the device is the
    // processor, and copies for it from HostMemory are in vain where it imports that.
    bool copies_at_once() const;
    // nullptr where the device does not offer the stage.
    const defrec_stage_table* stage_table(uint32_t stage) const;

    // Calls one function of the plugin, after which the thread's floating point mode is as it was,
    // and throws unless it answers with 0 or more, which is
    // returned. what names the call in the text, static storage: "queue_create". After
    // DEFREC_ERROR_DEVICE_LOST every further call fails with the same, uncalled.
    template <class Function, class... Args>
    defrec_status call(const char* what, Function function, Args... args) const {
        begin_call(what);
        defrec_status status = DEFREC_OK;
        try {
            const Inside inside(*this, what);
            status = function(args...);
        } catch (...) {
            refuse_exception(what);
        }
        return end_call(what, status);
    }
    // Calls a function that returns nothing and ends something; what it throws is logged.
    template <class Function, class... Args>
    void release(const char* what, Function function, Args... args) const noexcept {
        try {
            const Inside inside(*this, what);
            function(args...);
        } catch (...) {
            log_exception(what);
        }
    }
    // The device did not answer in time: it is lost, and quarantined.
    [[noreturn]] void refuse_unanswered(const char* what) const;
    std::chrono::milliseconds deadline() const;

  private:
    // The scope of a call. what: static storage.
    class Inside {
      public:
        Inside(const Device& device, const char* what) : device_(device), what_(what) {
            if (device_.watch_ != nullptr) device_.watch_->enter(what);
        }
        ~Inside() {
            if (mode_.restore()) device_.tell_changed_mode(what_);
            if (device_.watch_ != nullptr) device_.watch_->leave();
        }
        Inside(const Inside&) = delete;
        Inside& operator=(const Inside&) = delete;

      private:
        const Device& device_;
        const char* what_;
        KeptFloatingPoint mode_;
    };
    void tell_changed_mode(const char* what) const noexcept;
    void begin_call(const char* what) const;
    defrec_status end_call(const char* what, defrec_status status) const;
    [[noreturn]] void refuse_exception(const char* what) const;
    void log_exception(const char* what) const noexcept;
    void keep_thread(const char* what) const noexcept;
    void log(int32_t level, const char* what, const char* happened) const noexcept;

    std::shared_ptr<const LoadedPlugin> plugin_;
    const size_t index_;
    const defrec_plugin* table_;
    const std::shared_ptr<DeviceWatch> watch_;
    std::string id_;
    uint32_t stages_;
    defrec_pdevice* device_ = nullptr;
    mutable std::atomic<bool> lost_{false};
    mutable std::atomic<bool> has_told_mode_{false};
};

// Movable; empty after a move and when made without arguments.
class DeviceBuffer {
  public:
    DeviceBuffer() = default;
    // Zeroed memory of that many bytes.
    DeviceBuffer(std::shared_ptr<const Device> device, uint64_t size);
    // The caller's memory, without a copy; it must outlive the buffer. kind: DEFREC_MEMORY_*.
    // Throws Error(DEFREC_ERROR_UNSUPPORTED) where the device cannot reach it.
    static DeviceBuffer import(std::shared_ptr<const Device> device, uint32_t kind, void* memory,
                               uint64_t size);
    DeviceBuffer(DeviceBuffer&& other) noexcept { swap(other); }
    DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
        DeviceBuffer(std::move(other)).swap(*this);
        return *this;
    }
    ~DeviceBuffer();

    explicit operator bool() const { return buffer_ != nullptr; }
    uint64_t size() const { return size_; }
    defrec_pbuffer* get() const { return buffer_; }
    const std::shared_ptr<const Device>& device() const { return device_; }

  private:
    void swap(DeviceBuffer& other) noexcept {
        std::swap(device_, other.device_);
        std::swap(buffer_, other.buffer_);
        std::swap(size_, other.size_);
    }
    std::shared_ptr<const Device> device_;
    defrec_pbuffer* buffer_ = nullptr;
    uint64_t size_ = 0;
};

// Memory of the host, zeroed and 64-byte aligned, that the device's copies reach without a detour;
// the context's allocator's where the plugin has none of its own. Must outlive the queues whose
// work uses it. Movable; empty after a move and when made without arguments.
class HostMemory {
  public:
    HostMemory() = default;
    HostMemory(std::shared_ptr<const Device> device, uint64_t size);
    HostMemory(HostMemory&& other) noexcept { swap(other); }
    HostMemory& operator=(HostMemory&& other) noexcept {
        HostMemory(std::move(other)).swap(*this);
        return *this;
    }
    ~HostMemory();

    // The same bytes as a buffer of the device, where that is the processor; else an empty one. The
    // memory must outlive it.
    DeviceBuffer as_buffer() const;

    uint64_t size() const { return size_; }  // bytes
    // What lies there as values of a trivial type; a remainder is left out.
    template <class T>
    std::span<T> as() {
        return {static_cast<T*>(memory_), size_ / sizeof(T)};
    }
    template <class T>
    std::span<const T> as() const {
        return {static_cast<const T*>(memory_), size_ / sizeof(T)};
    }

  private:
    void swap(HostMemory& other) noexcept {
        std::swap(device_, other.device_);
        std::swap(memory_, other.memory_);
        std::swap(size_, other.size_);
    }
    std::shared_ptr<const Device> device_;
    void* memory_ = nullptr;
    uint64_t size_ = 0;
};

// In-order work on a device; one thread at a time, but wait from any. Destroying it waits for its
// work.
class Queue {
  public:
    explicit Queue(std::shared_ptr<const Device> device);
    ~Queue();
    Queue(const Queue&) = delete;
    Queue& operator=(const Queue&) = delete;

    // Bytes; src is read before it returns. Throws if the range does not lie in the buffer.
    void write(const DeviceBuffer& buffer, const void* src, uint64_t size, uint64_t offset = 0);
    // As write, but src may be read until a later signal has been waited for; where it is a
    // HostMemory nothing is copied in between.
    void write_in_place(const DeviceBuffer& buffer, const void* src, uint64_t size,
                        uint64_t offset = 0);
    // dst is complete after a later signal has been waited for.
    void read(const DeviceBuffer& buffer, void* dst, uint64_t size, uint64_t offset = 0);
    // A point after all work so far; grows.
    uint64_t signal();
    // false: not yet.
    bool wait(uint64_t value, uint64_t timeout_ns);
    // As long as the device may take for a frame's work.
    void wait(uint64_t value);
    // signal, and wait for it.
    void finish();

    const std::shared_ptr<const Device>& device() const { return device_; }
    defrec_pqueue* get() const { return queue_; }

  private:
    std::shared_ptr<const Device> device_;
    defrec_pqueue* queue_ = nullptr;
};

// nullptr stands for an optional buffer that is not given.
using BufferList = std::initializer_list<const DeviceBuffer*>;
using BufferSpan = std::span<const DeviceBuffer* const>;

class DeviceStage {
  public:
    // params: the stage's defrec_*_params, checked and with every default filled in
    // (stage_params.hpp). Throws Error(DEFREC_ERROR_UNSUPPORTED) with the plugin's limit where the
    // device cannot.
    DeviceStage(std::shared_ptr<const Device> device, uint32_t stage, const void* params);
    ~DeviceStage();
    DeviceStage(const DeviceStage&) = delete;
    DeviceStage& operator=(const DeviceStage&) = delete;

    // The order of the buffers is the stage's definition, docs/stages.md. enqueue never allocates.
    void prepare(Queue& queue, BufferSpan in);
    void prepare(Queue& queue, BufferList in) { prepare(queue, BufferSpan(in.begin(), in.size())); }
    void enqueue(Queue& queue, BufferSpan in, BufferSpan out);
    void enqueue(Queue& queue, BufferList in, BufferList out) {
        enqueue(queue, BufferSpan(in.begin(), in.size()), BufferSpan(out.begin(), out.size()));
    }

  private:
    using Pointers = std::array<defrec_pbuffer*, kMaxStageBuffers>;
    static size_t collect(BufferSpan buffers, Pointers& out);

    std::shared_ptr<const Device> device_;
    const defrec_stage_table* table_ = nullptr;
    defrec_pstage* stage_ = nullptr;
};

}  // namespace defrec
