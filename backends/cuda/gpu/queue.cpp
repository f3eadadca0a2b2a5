// See queue.hpp.
#include "backends/cuda/gpu/queue.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <thread>
#include <utility>

#include "backends/cuda/gpu/check.hpp"

namespace defrec::cuda {
namespace {

constexpr uint64_t kLeastStaging = 4096;
constexpr std::chrono::milliseconds kLook{4};    // how long a wait looks before it sleeps: longer than a frame
constexpr std::chrono::microseconds kSleep{100};
constexpr size_t kMostGraphs = 128;  // a tracker's frames in flight, its two sets of buffers and an application's ring of memory combine
enum : uint64_t { kRun = 1, kUpload = 2, kDownload = 3 };

uint64_t address(const void* memory) { return reinterpret_cast<uintptr_t>(memory); }

}  // namespace

Queue::Queue(Gpu& gpu) : gpu_(gpu), count_(gpu, sizeof(uint64_t)), count_on_host_(gpu, sizeof(uint64_t)) {
    gpu.clear(count_.data(), count_.size());
    progress_ = {count_.as<uint64_t>(), reinterpret_cast<volatile uint64_t*>(count_on_host_.data())};
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
    pending_key_.insert(pending_key_.end(), {kRun, run->serial});
    pending_.emplace_back(std::move(run));
}

void Queue::gather(uint64_t kind, const Buffer& buffer, uint64_t offset, const void* on_host, uint64_t size, Operation operation) {
    pending_key_.insert(pending_key_.end(), {kind, buffer.serial(), offset, gpu_.host_serial(on_host, size), address(on_host), size});
    pending_.push_back(std::move(operation));
}

void Queue::write(const Buffer& buffer, uint64_t offset, const void* src, uint64_t size) {
    if (size == 0) return;
    const std::lock_guard lock(mutex_);
    std::byte* from = staging_[staging(size)].buffer.data();
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
    void* to = dst;
    if (gpu_.host_serial(dst, size) == 0) {
        const size_t index = staging(size);
        to = staging_[index].buffer.data();
        reads_.push_back({index, dst, size, submitted_ + 1});
        // Until its bytes are delivered, not only until they are copied.
        staging_[index].busy_until = UINT64_MAX;
    }
    gather(kDownload, buffer, offset, to, size, Download{to, buffer.data() + offset, size});
}

std::vector<std::byte> Queue::contents(const Buffer& buffer) {
    std::vector<std::byte> bytes(std::max<uint64_t>(buffer.size(), 1));
    try {
        read(buffer, 0, bytes.data(), buffer.size());
        wait(signal(), UINT64_MAX);
    } catch (...) {
        forget_read(bytes.data());
        throw;
    }
    return bytes;
}

void Queue::forget_read(const void* dst) {
    const std::lock_guard lock(mutex_);
    std::erase_if(reads_, [&](const PendingRead& read) {
        if (read.dst != dst) return false;
        staging_[read.staging].busy_until = read.value;
        return true;
    });
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
    while (completed() < value && !past(std::min<std::chrono::nanoseconds>(timeout, kLook))) std::this_thread::yield();
    while (completed() < value) {
        const Gpu::Use use(gpu_);
        const cudaError_t state = cudaStreamQuery(stream_);
        if (state != cudaErrorNotReady) check(state, "cudaStreamQuery");
        if (completed() >= value) break;
        if (past(timeout)) return false;
        std::this_thread::sleep_for(kSleep);
    }
    const std::lock_guard lock(mutex_);
    deliver(value);
    return true;
}

void Queue::deliver(uint64_t value) {
    std::erase_if(reads_, [&](const PendingRead& read) {
        if (read.value > value) return false;
        std::memcpy(read.dst, staging_[read.staging].buffer.data(), read.size);
        staging_[read.staging].busy_until = 0;
        return true;
    });
}

// The smallest free buffer that is large enough; a new one where there is none, which ends once a frame has been through.
size_t Queue::staging(uint64_t size) {
    const uint64_t done = completed();
    size_t best = staging_.size();
    for (size_t i = 0; i < staging_.size(); ++i)
        if (staging_[i].busy_until <= done && staging_[i].buffer.size() >= size &&
            (best == staging_.size() || staging_[i].buffer.size() < staging_[best].buffer.size()))
            best = i;
    if (best == staging_.size()) staging_.push_back({HostBuffer(gpu_, std::bit_ceil(std::max(size, kLeastStaging))), 0});
    staging_[best].busy_until = submitted_ + 1;
    return best;
}

Graph& Queue::graph_of_pending() {
    const auto known = std::find_if(graphs_.begin(), graphs_.end(), [&](const KnownGraph& graph) { return graph.key == pending_key_; });
    if (known != graphs_.end()) {
        graphs_.splice(graphs_.begin(), graphs_, known);
        return known->graph;
    }
    if (graphs_.size() == kMostGraphs) {
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

// What has gathered will not run. Its reads must not be delivered: the next submission gets the value that they wait for.
void Queue::drop_pending() noexcept {
    pending_.clear();
    pending_key_.clear();
    std::erase_if(reads_, [&](const PendingRead& read) {
        if (read.value <= submitted_) return false;
        staging_[read.staging].busy_until = 0;
        return true;
    });
}

// Work that the device does not take is none to wait for; but whoever gathered it must hear of it.
void Queue::settle() noexcept {
    const std::lock_guard lock(mutex_);
    const Gpu::Use use(gpu_);
    try {
        if (!pending_.empty()) submit();
    } catch (const std::exception&) {
        settle_failure_ = std::current_exception();
    }
    cudaStreamSynchronize(stream_);
}

}  // namespace defrec::cuda
