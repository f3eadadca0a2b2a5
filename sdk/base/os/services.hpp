// What a context lends to everything made from it, plugins included: log, memory, threads. No
// plugins, no devices.
#pragma once
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <type_traits>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/base/os/background_thread.hpp"
#include "sdk/base/os/thread_pool.hpp"

namespace defrec {

// Every function may be called from any thread. The application's callbacks are called from here
// and nowhere else.
class Services {
  public:
    // desc is complete (copied in, defaults not filled). Throws Error.
    explicit Services(const defrec_context_desc& desc);
    Services(const Services&) = delete;
    Services& operator=(const Services&) = delete;

    // level: DEFREC_LOG_*. Never throws.
    void log(int32_t level, const char* source, const char* text) const noexcept;

    // nullptr when out of memory; alignment is a power of two.
    void* allocate(size_t size, size_t alignment) const noexcept;
    void release(void* memory) const noexcept;

    // Calls body(arg, 0 .. count-1), each once, on any threads, and returns when all have returned.
    // A call from within a body runs on the calling thread alone. The body must not throw.
    void parallel_for_raw(size_t count, void (*body)(void* arg, size_t index),
                          void* arg) const noexcept;
    template <class Body>
    void parallel_for(size_t count, Body&& body) const noexcept {
        auto call = [](void* arg, size_t index) {
            (*static_cast<std::remove_reference_t<Body>*>(arg))(index);
        };
        parallel_for_raw(count, call, const_cast<void*>(static_cast<const void*>(&body)));
    }
    // Before loops for so many threads besides the caller's are to begin, by the time that waking a
    // thread takes. Threads of the application are not woken.
    void rouse(size_t threads) const noexcept {
        if (pool_ != nullptr) pool_->rouse(threads);
    }
    // Threads besides the caller's that a loop finds awake.
    uint32_t awake() const noexcept { return pool_ != nullptr ? pool_->awake() : 0; }
    // Where loops run on the library's own threads, else nullptr: an application's parallel_for may
    // hang, and only calls into a plugin are watched.
    const Services* own_threads() const noexcept { return pool_ != nullptr ? this : nullptr; }
    // Threads that parallel_for uses, at least 1.
    uint32_t concurrency() const noexcept;

    // For work that no frame waits for. What a task holds must not keep the services alive.
    BackgroundThread& background() const noexcept { return background_; }

    // How long a plugin may take to answer.
    std::chrono::milliseconds plugin_deadline() const noexcept {
        return std::chrono::milliseconds(desc_.plugin_deadline_ms);
    }
    // A thread that is inside a plugin was left there. It may come back after the application is
    // done with the context, and call what belongs to the application no more:
    void leave_behind() const noexcept { left_behind_ = true; }
    // from here on, where a thread was left behind. Memory that it gives back is not freed.
    void end_callbacks() const noexcept { ended_ = left_behind_.load(); }

    // Forgets what the application's parallel_for did before on this thread.
    static void forget_parallel_failure() noexcept;
    // Throws Error(DEFREC_ERROR_STATE) if since then it broke its contract (threw, left bodies
    // out): what was computed is not to be trusted. what names it.
    static void expect_parallel_success(const char* what);

  private:
    defrec_context_desc desc_;
    mutable std::atomic<bool> left_behind_{false}, ended_{false};
    mutable BackgroundThread background_;
    std::unique_ptr<ThreadPool> pool_;  // null with the application's own threads
};

// Memory from the context's allocator, cache-line aligned. The services outlive it.
template <class T>
class ContextAllocator {
  public:
    using value_type = T;
    using propagate_on_container_move_assignment = std::true_type;
    using propagate_on_container_copy_assignment = std::true_type;
    using propagate_on_container_swap = std::true_type;
    // NOLINTNEXTLINE(google-explicit-constructor): for ContextVector<T>(count, allocator())
    ContextAllocator(std::shared_ptr<const Services> services) : services_(std::move(services)) {}
    template <class U>  // NOLINTNEXTLINE(google-explicit-constructor): an allocator converts
    ContextAllocator(const ContextAllocator<U>& other) : services_(other.services()) {}

    T* allocate(size_t count) {
        if (count > SIZE_MAX / sizeof(T)) throw std::bad_alloc();
        void* memory = services_->allocate(count * sizeof(T), 64);
        if (memory == nullptr) throw std::bad_alloc();
        return static_cast<T*>(memory);
    }
    void deallocate(T* memory, size_t) noexcept { services_->release(memory); }
    const std::shared_ptr<const Services>& services() const { return services_; }
    template <class U>
    bool operator==(const ContextAllocator<U>& other) const {
        return services_ == other.services();
    }

  private:
    std::shared_ptr<const Services> services_;
};
// Construct with context.allocator(): ContextVector<float> values(context.allocator());
template <class T>
using ContextVector = std::vector<T, ContextAllocator<T>>;

}  // namespace defrec
