// See queue.hpp.
#include "backends/cuda/gpu/queue.hpp"

#include <algorithm>
#include <cstring>
#include <thread>
#include <utility>

#include "backends/cuda/gpu/check.hpp"

namespace defrec::cuda {
namespace {

constexpr std::chrono::milliseconds kLook{
    4};  // how long a wait looks before it sleeps: longer than a frame
constexpr std::chrono::microseconds kSleep{100};
constexpr size_t kMaxGraphs = 128;  // a tracker's frames in flight, its two sets of buffers and an
                                    // application's ring of memory combine
enum : uint64_t { kRun = 1, kUpload = 2, kDownload = 3 };

uint64_t address(const void* memory) { return reinterpret_cast<uintptr_t>(memory); }

}  // namespace

Queue::Queue(Gpu& gpu)
    : gpu_(gpu), count_(gpu, sizeof(uint64_t)), count_on_host_(gpu, sizeof(uint64_t)) {
    gpu.clear(count_.data(), count_.size());
    progress_ = {count_.as<uint64_t>(),
                 reinterpret_cast<volatile uint64_t*>(count_on_host_.data())};
    const Gpu::Use use(gpu);
    check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate");
    try {
        gpu.attach(*this);
    } catch (...) {
        cudaStreamDestroy(stream_);
        throw;
    }
}

Queue::~Queue() {
    gpu_.detach(*this);
    settle();
    const Gpu::Use use(gpu_);
    // Reads that nobody waited for stay undone: after a failure their destinations may be gone.
    graphs_.clear();
    cudaStreamDestroy(stream_);
}

void Queue::run(std::shared_ptr<const StageRun> run) {
    const std::lock_guard lock(mutex_);
    gather({kRun, run->serial}, run);
}

void Queue::gather(uint64_t kind, const Buffer& buffer, uint64_t offset, const void* on_host,
                   uint64_t size, Operation operation) {
    gather({kind, buffer.serial(), offset, gpu_.host_serial(on_host, size), address(on_host), size},
           std::move(operation));
}

// Both or neither: a key of other operations than these would name a wrong graph for ever.
void Queue::gather(std::initializer_list<uint64_t> key, Operation operation) {
    pending_.push_back(std::move(operation));
    try {
        pending_key_.insert(pending_key_.end(), key);
    } catch (...) {
        pending_.pop_back();
        throw;
    }
}

void Queue::write(const Buffer& buffer, uint64_t offset, const void* src, uint64_t size) {
    if (size == 0) return;
    const std::lock_guard lock(mutex_);
    std::byte* from = take_staging(size).bytes();
    std::memcpy(from, src, size);
    gather(kUpload, buffer, offset, from, size, Upload{buffer.data() + offset, from, size});
}

void Queue::write_in_place(const Buffer& buffer, uint64_t offset, const void* src, uint64_t size) {
    if (size == 0 || gpu_.host_serial(src, size) == 0) return write(buffer, offset, src, size);
    const std::lock_guard lock(mutex_);
    gather(kUpload, buffer, offset, src, size, Upload{buffer.data() + offset, src, size});
}

void Queue::read(const Buffer& buffer, uint64_t offset, void* dst, uint64_t size) {
    if (size == 0) return;
    const std::lock_guard lock(mutex_);
    const auto download_to = [&](void* to) {
        gather(kDownload, buffer, offset, to, size, Download{to, buffer.data() + offset, size});
    };
    if (gpu_.host_serial(dst, size) != 0) return download_to(dst);
    HostStaging::Slot& staging = take_staging(size);
    download_to(staging.bytes());
    staging_.deliver_later(staging, dst, size);
}

void Queue::forget_read(const void* dst) {
    const std::lock_guard lock(mutex_);
    staging_.forget(dst);
}

uint64_t Queue::signal() {
    const std::lock_guard lock(mutex_);
    if (settle_failure_ != nullptr) {
        drop_pending();
        std::rethrow_exception(std::exchange(settle_failure_, nullptr));
    }
    submit();
    return submitted_;
}

bool Queue::wait(uint64_t value, uint64_t timeout_ns) {
    {
        const std::lock_guard lock(mutex_);
        if (value > submitted_) return false;
    }
    const auto start = Clock::now();
    const auto past = [&](std::chrono::nanoseconds time) { return Clock::now() - start >= time; };
    const auto timeout = std::chrono::nanoseconds(std::min<uint64_t>(timeout_ns, INT64_MAX));
    // Waking a thread costs a good part of a short wait.
    while (completed() < value && !past(std::min<std::chrono::nanoseconds>(timeout, kLook)))
        std::this_thread::yield();
    while (completed() < value) {
        const Gpu::Use use(gpu_);
        const cudaError_t state = cudaStreamQuery(stream_);
        if (state != cudaErrorNotReady) check(state, "cudaStreamQuery");
        if (completed() >= value) break;
        if (past(timeout)) return false;
        std::this_thread::sleep_for(kSleep);
    }
    const std::lock_guard lock(mutex_);
    staging_.deliver(value);
    return true;
}

Queue::HostStaging::Slot& Queue::take_staging(uint64_t size) {
    return staging_.take(size, completed(), submitted_ + 1,
                         [&](uint64_t at_least) { return HostBuffer(gpu_, at_least); });
}

Graph& Queue::graph_of_pending() {
    const auto known = std::find_if(graphs_.begin(), graphs_.end(), [&](const KnownGraph& graph) {
        return graph.key == pending_key_;
    });
    if (known != graphs_.end()) {
        graphs_.splice(graphs_.begin(), graphs_, known);
        return known->graph;
    }
    if (graphs_.size() == kMaxGraphs) {
        check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
        graphs_.pop_back();
    }
    return graphs_.emplace_front(pending_key_, pending_, progress_, gpu_.limits()).graph;
}

void Queue::submit() {
    const Gpu::Use use(gpu_);
    try {
        graph_of_pending().launch(stream_);
    } catch (...) {
        drop_pending();
        throw;
    }
    ++submitted_;
    pending_.clear();
    pending_key_.clear();
}

// What has gathered will not run.
void Queue::drop_pending() noexcept {
    pending_.clear();
    pending_key_.clear();
    staging_.drop_after(submitted_);
}

// Work that the device does not take is none to wait for; but whoever gathered it must hear of it.
void Queue::settle() noexcept {
    const Gpu::Use use(gpu_);
    {
        const std::lock_guard lock(mutex_);
        try {
            if (!pending_.empty()) submit();
        } catch (const std::exception&) {
            settle_failure_ = std::current_exception();
        }
    }
    // Without the lock: a wait by another thread has a time-out to keep.
    cudaStreamSynchronize(stream_);
}

}  // namespace defrec::cuda
