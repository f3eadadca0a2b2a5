// In-order work on a device. Commands gather until a signal and are then submitted together; a
// timeline semaphore tells how far the device is. Nothing waits but wait and the destructor.
#pragma once
#include <volk.h>

#include <chrono>
#include <cstddef>
#include <exception>
#include <mutex>
#include <vector>

#include "backends/shared/staging.hpp"
#include "backends/vulkan/device.hpp"

namespace defrec::vulkan {

// threads: one, but wait: any.
class Queue {
  public:
    explicit Queue(Device& device);
    ~Queue();
    Queue(const Queue&) = delete;
    Queue& operator=(const Queue&) = delete;

    // Runs after everything before, but for the recordings just before, of which each of its
    // operations waits only for what it depends on. It stays as it is until its work is done.
    void run(const Recording& recording);
    // src is read before it returns.
    void write(const Buffer& buffer, uint64_t offset, const void* src, uint64_t size);
    // src, if in memory of Device::allocate_host, is read until a later signal has been waited for;
    // other memory as write does.
    void write_in_place(const Buffer& buffer, uint64_t offset, const void* src, uint64_t size);
    // dst is filled by the first wait for a later signal that succeeds, or not at all; memory of
    // Device::allocate_host by the device itself.
    void read(const Buffer& buffer, uint64_t offset, void* dst, uint64_t size);
    // A read into dst that was not delivered yet never is.
    void forget_read(const void* dst);
    // A point after all work so far; grows by one. If it fails, nothing that gathered runs, and no
    // read of it is delivered.
    uint64_t signal();
    // False: not yet, or never signalled.
    bool wait(uint64_t value, uint64_t timeout_ns);

  private:
    friend class Device;
    using Clock = std::chrono::steady_clock;
    // What is reused when the semaphore has reached busy_until.
    struct Transient {
        VkCommandBuffer commands;
        uint64_t busy_until;
    };
    struct Range {
        uint64_t serial, begin, end;  // of a buffer, bytes
    };
    using HostStaging = Staging<Buffer, &Buffer::mapped>;

    uint64_t completed();
    VkCommandBuffer copies();
    void close_copies();
    void close_runs();
    HostStaging::Slot& take(HostStaging& staging, uint64_t size, MemoryUse use);
    void copy(const Buffer& from, uint64_t from_offset, const Buffer& to, uint64_t to_offset,
              uint64_t size);
    void submit();
    void drop_pending() noexcept;
    void look_for(uint64_t value, Clock::time_point end);
    void flush_pending() noexcept;  // submits
    void settle() noexcept;         // for Device::settle
    void destroy() noexcept;

    Device& device_;
    const VolkDeviceTable& vk_;
    LogicalDevice::HardwareQueue& shared_;
    VkSemaphore semaphore_ = VK_NULL_HANDLE;
    VkCommandPool pool_ = VK_NULL_HANDLE;

    std::mutex mutex_;        // of all below
    uint64_t submitted_ = 0;  // value of the last submission
    std::vector<VkCommandBuffer> pending_;
    // Behind what is pending. There is none while open_ is.
    std::vector<const Recording*> runs_;
    std::vector<Transient> transients_;
    VkCommandBuffer open_ = VK_NULL_HANDLE;  // the transient that copies are being recorded into
    std::vector<Range> copied_from_, copied_to_;  // behind the last barrier there
    HostStaging upload_, download_;
    std::exception_ptr flush_failure_;  // for the next signal to report
};

}  // namespace defrec::vulkan
