// In-order work on a GPU. Operations gather until a signal and are then launched as one graph, made
// once for each sequence of operations; its last kernel writes how far the device is into the
// host's memory, where waiting looks. Nothing waits but wait and the destructor.
#pragma once
#include <chrono>
#include <cstddef>
#include <exception>
#include <initializer_list>
#include <list>
#include <mutex>
#include <vector>

#include "backends/cuda/gpu/gpu.hpp"
#include "backends/cuda/gpu/graph.hpp"
#include "backends/shared/staging.hpp"

namespace defrec::cuda {

// Page-locked memory of the host.
class HostBuffer {
  public:
    HostBuffer() = default;
    HostBuffer(Gpu& gpu, uint64_t size)
        : gpu_(&gpu), data_(static_cast<std::byte*>(gpu.allocate_host(size))), size_(size) {}
    HostBuffer(HostBuffer&& other) noexcept { swap(other); }
    HostBuffer& operator=(HostBuffer&& other) noexcept {
        HostBuffer(std::move(other)).swap(*this);
        return *this;
    }
    ~HostBuffer() {
        if (gpu_ != nullptr) gpu_->release_host(data_);
    }
    std::byte* data() const { return data_; }
    uint64_t size() const { return size_; }

  private:
    void swap(HostBuffer& other) noexcept {
        std::swap(gpu_, other.gpu_);
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
    }
    Gpu* gpu_ = nullptr;
    std::byte* data_ = nullptr;
    uint64_t size_ = 0;
};

// threads: one, but wait and settle: any.
class Queue {
  public:
    explicit Queue(Gpu& gpu);
    ~Queue();
    Queue(const Queue&) = delete;
    Queue& operator=(const Queue&) = delete;

    void run(std::shared_ptr<const StageRun> run);
    // src is read before it returns.
    void write(const Buffer& buffer, uint64_t offset, const void* src, uint64_t size);
    // src, if in memory of Gpu::allocate_host, is read until a later signal has been waited for;
    // other memory as write does.
    void write_in_place(const Buffer& buffer, uint64_t offset, const void* src, uint64_t size);
    // dst is filled by the first wait for a later signal that succeeds, or not at all; memory of
    // Gpu::allocate_host by the device itself.
    void read(const Buffer& buffer, uint64_t offset, void* dst, uint64_t size);
    // A read into dst that was not delivered yet never is.
    void forget_read(const void* dst);
    // A point after all work so far; grows by one. If it fails, nothing that gathered runs, and no
    // read of it is delivered.
    uint64_t signal();
    // False: not yet, or never signalled.
    bool wait(uint64_t value, uint64_t timeout_ns);
    // Submits what has gathered and waits until it is done.
    void settle() noexcept;

    Gpu& gpu() { return gpu_; }

  private:
    using Clock = std::chrono::steady_clock;
    using HostStaging = Staging<HostBuffer, &HostBuffer::data>;
    using Key = std::vector<uint64_t>;
    struct KnownGraph {
        Key key;
        Graph graph;
        KnownGraph(const Key& its_key, std::span<const Operation> operations,
                   const Progress& progress, const Limits& limits)
            : key(its_key), graph(operations, progress, limits) {}
    };

    uint64_t completed() const { return __atomic_load_n(progress_.on_host, __ATOMIC_ACQUIRE); }
    HostStaging::Slot& take_staging(uint64_t size);
    void gather(std::initializer_list<uint64_t> key, Operation operation);
    void gather(uint64_t kind, const Buffer& buffer, uint64_t offset, const void* on_host,
                uint64_t size, Operation operation);
    void submit();
    Graph& graph_of_pending();
    void drop_pending() noexcept;

    Gpu& gpu_;
    cudaStream_t stream_ = nullptr;
    Buffer count_;
    HostBuffer count_on_host_;
    Progress progress_;

    std::mutex mutex_;        // of all below
    uint64_t submitted_ = 0;  // value of the last submission
    std::vector<Operation> pending_;
    Key pending_key_;  // which operations, and on which memory: an address alone may be another's
                       // by the time a graph runs again
    std::list<KnownGraph> graphs_;  // the last used first
    HostStaging staging_;
    std::exception_ptr settle_failure_;  // for the next signal to report
};

}  // namespace defrec::cuda
