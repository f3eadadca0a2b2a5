// A GPU that CUDA drives.
#pragma once
#include <cuda_runtime_api.h>

#include <map>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <vector>

#include "backends/cuda/device/device.hpp"

namespace defrec::cuda {

class Queue;

struct GpuInfo {
    int ordinal;
    std::string id;  // "cuda:GPU-" and the UUID
    std::string name;
    std::string driver;  // its version, and the newest CUDA that it knows: "580.65.06, CUDA 13.0"
    uint64_t memory_bytes;
    std::string lacks;   // why the stages do not run on it; empty: they do
    std::string broken;  // why nothing but the ordinal is known of it; empty: it is
};
// Those of the machine. Empty where there is no driver or none new enough; why_none says so.
std::vector<GpuInfo> list_gpus(std::string& why_none);

class Gpu final : public Device {
  public:
    explicit Gpu(int ordinal);
    ~Gpu() override;
    Gpu(const Gpu&) = delete;
    Gpu& operator=(const Gpu&) = delete;

    // Makes the device's primary context that of this thread, and allows it every call while
    // another thread captures a graph; what the application had is back at the end. Every function
    // here does it by itself; those who call CUDA on their own need it.
    class Use {
      public:
        explicit Use(const Gpu& gpu);
        ~Use();
        Use(const Use&) = delete;
        Use& operator=(const Use&) = delete;

      private:
        cudaStreamCaptureMode mode_ = cudaStreamCaptureModeRelaxed;  // then the thread's own
    };

    const Limits& limits() const override { return limits_; }
    std::byte* allocate(uint64_t size) override;
    void release(std::byte* memory) noexcept override;
    void copy_to_device(std::byte* to, const void* from, uint64_t size) override;
    void clear(std::byte* memory, uint64_t size) override;
    uint32_t resident_blocks(const void* function, uint32_t threads, size_t shared) const override;
    bool holds_cluster(const void* function, uint32_t blocks, uint32_t threads,
                       size_t shared) const override;

    // Page-locked memory of the host, zero.
    void* allocate_host(uint64_t size);
    void release_host(void* memory) noexcept;
    // Serial, as Buffer::serial, of the memory of allocate_host that a range lies in; 0: it lies in
    // none.
    uint64_t host_serial(const void* memory, uint64_t size) const;

    // Throws StageError unless the range is memory of this device.
    void expect_device_memory(const void* memory, uint64_t size) const;

    // Submits what every queue has gathered and waits until all is done: then anything may be
    // destroyed.
    void settle() noexcept;

  private:
    friend class Queue;
    void attach(Queue& queue);
    void detach(Queue& queue) noexcept;

    int ordinal_;
    Limits limits_;
    void* context_ = nullptr;  // the primary context
    cudaStream_t stream_ = nullptr;
    mutable std::shared_mutex host_mutex_;
    struct HostMemory {
        uint64_t size, serial;
    };
    std::map<const std::byte*, HostMemory> host_memory_;  // by address
    std::mutex queue_mutex_;
    std::vector<Queue*> queues_;
};

}  // namespace defrec::cuda
