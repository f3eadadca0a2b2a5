// What a stage of a backend in host memory looks like from outside: made from parameters, prepared
// with a template, run on buffers. plugins/base puts it behind the plugin ABI. Not part of any
// public interface.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "include/defrec_plugin.h"
#include "sdk/contract/stage_params.hpp"

namespace defrec {

// What a stage throws; plugins/base turns it into the status and the text of the last error.
class StageError : public std::runtime_error {
  public:
    StageError(defrec_status status, const std::string& text)
        : std::runtime_error(text), status_(status) {}
    defrec_status status() const { return status_; }

  private:
    defrec_status status_;
};

// Throws StageError where complete parameters (fill_defaults) are out of a range of defrec_c.h.
template <class Params>
void check_params(const Params& params) {
    const std::string error = range_error(params);
    if (!error.empty()) throw StageError(DEFREC_ERROR_ARGUMENT, error);
}

// The host's services as C++ sees them. Copyable; the table outlives every copy.
class Host {
  public:
    explicit Host(const defrec_host* table) : table_(table) {}

    void* allocate(size_t size, size_t alignment) const {
        void* memory = table_->alloc(table_->self, size, alignment);
        if (memory == nullptr) throw std::bad_alloc();
        return memory;
    }
    void release(void* memory) const { table_->free(table_->self, memory); }

    // Calls body(0 .. count-1), each once, on any threads; returns when all have returned. body
    // must not throw.
    template <class Body>
    void parallel_for(size_t count, Body&& body) const {
        auto call = [](void* arg, size_t index) {
            (*static_cast<std::remove_reference_t<Body>*>(arg))(index);
        };
        table_->parallel_for(table_->self, count, call, &body);
    }
    size_t concurrency() const { return table_->concurrency(table_->self); }

    bool operator==(const Host& other) const { return table_ == other.table_; }

  private:
    const defrec_host* table_;
};

// Memory from the host's allocator, cache-line aligned, zeroed by std::vector.
template <class T>
class HostAllocator {
  public:
    using value_type = T;
    explicit HostAllocator(const Host& host) : host_(host) {}
    template <class U>  // NOLINTNEXTLINE(google-explicit-constructor): an allocator converts
    HostAllocator(const HostAllocator<U>& other) : host_(other.host()) {}
    T* allocate(size_t count) { return static_cast<T*>(host_.allocate(count * sizeof(T), 64)); }
    void deallocate(T* memory, size_t) { host_.release(memory); }
    const Host& host() const { return host_; }
    template <class U>
    bool operator==(const HostAllocator<U>& other) const {
        return host_ == other.host();
    }

  private:
    Host host_;
};
template <class T>
using HostVector = std::vector<T, HostAllocator<T>>;

// A buffer in host memory; data is nullptr where an optional one was not given.
struct InBuffer {
    const void* data = nullptr;
    uint64_t size = 0;
    template <class T>
    const T* as() const {
        return static_cast<const T*>(data);
    }
};
struct OutBuffer {
    void* data = nullptr;
    uint64_t size = 0;
    template <class T>
    T* as() const {
        return static_cast<T*>(data);
    }
};

class Stage {
  public:
    virtual ~Stage() = default;
    // Reads the inputs that stay the same from run to run. May allocate.
    virtual void prepare(std::span<const InBuffer>) {
        throw StageError(DEFREC_ERROR_ARGUMENT, "this stage has nothing to prepare");
    }
    // Computes every output. Does not allocate.
    virtual void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) = 0;
};

namespace detail {
template <class T, class Buffer>
auto take(const char* what, const Buffer& buffer, size_t count) {
    if (buffer.size < count * sizeof(T))
        throw StageError(DEFREC_ERROR_ARGUMENT, std::string(what) + ": buffer of " +
                                                    std::to_string(buffer.size) + " bytes given, " +
                                                    std::to_string(count * sizeof(T)) + " needed");
    return buffer.template as<T>();
}
}  // namespace detail
// The buffer as count elements of T; throws with the size needed if it is smaller.
template <class T>
const T* take(const char* what, const InBuffer& buffer, size_t count) {
    return detail::take<T>(what, buffer, count);
}
template <class T>
T* take(const char* what, const OutBuffer& buffer, size_t count) {
    return detail::take<T>(what, buffer, count);
}
}  // namespace defrec
