// An opened device: a logical device, which others may have opened too, with memory and queues of
// its own. It outlives everything made from it.
#pragma once
#include <volk.h>

#include <atomic>
#include <initializer_list>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "backends/vulkan/logical_device.hpp"
#include "backends/vulkan/memory.hpp"

namespace defrec::vulkan {

class Device;
class JointRecording;
class Queue;
class Recording;

// Memory that the device uses. Its size is as asked for; what lies behind it up to a multiple of 16
// bytes belongs to it.
class Buffer {
  public:
    Buffer() = default;
    Buffer(Device& device, uint64_t size, MemoryUse use = MemoryUse::device);
    Buffer(Buffer&& other) noexcept { swap(other); }
    Buffer& operator=(Buffer&& other) noexcept {
        Buffer(std::move(other)).swap(*this);
        return *this;
    }
    ~Buffer();

    explicit operator bool() const { return handle_ != VK_NULL_HANDLE; }
    VkBuffer handle() const { return handle_; }
    uint64_t size() const { return size_; }
    uint64_t serial() const { return serial_; }          // never given twice by a device
    std::byte* mapped() const { return range_.mapped; }  // nullptr for MemoryUse::device

  private:
    void swap(Buffer& other) noexcept;
    Device* device_ = nullptr;
    VkBuffer handle_ = VK_NULL_HANDLE;
    MemoryRange range_;
    uint64_t size_ = 0, serial_ = 0;
};

// Changes shaders before they are compiled, so that they tell a test what they do: each then has
// one binding more, behind its own, for results.
struct Instrument {
    Rewrite rewrite;
    Buffer results;
};

// threads: any.
class Device {
  public:
    explicit Device(std::shared_ptr<LogicalDevice> logical);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    LogicalDevice& logical() const { return *logical_; }
    VkDevice handle() const { return logical_->handle(); }
    const VolkDeviceTable& vk() const { return logical_->vk(); }
    const PhysicalDevice& physical() const { return logical_->physical(); }
    const VkPhysicalDeviceLimits& limits() const { return logical_->limits(); }
    MemoryPool& memory() { return memory_; }
    // Whether it runs so many invocations at once that few with much work each leave it idle, and
    // has packed dot products. Where the processor is the device, few invocations are faster.
    bool wide() const { return wide_; }

    // A buffer of the device with these bytes in it. Waits for the copy.
    Buffer upload(const void* data, uint64_t size);
    template <class T>
    Buffer upload(const std::vector<T>& values) {
        return upload(values.data(), values.size() * sizeof(T));
    }
    // Zeroes a buffer that nothing uses yet, and waits.
    void clear(const Buffer& buffer);
    // Memory of the host that copies of queues reach as it is, zero, 64-byte aligned.
    void* allocate_host(uint64_t size);
    void release_host(void* memory) noexcept;
    // Where such memory is for the device; buffer: nullptr where not all of it is.
    struct HostRange {
        const Buffer* buffer = nullptr;
        uint64_t offset = 0;
    };
    HostRange find_host(const void* memory, uint64_t size) const;
    // Stands for an optional buffer that was not given.
    const Buffer& nothing() const { return nothing_; }

    // These recordings in one command buffer; made once, kept as long as they are. VK_NULL_HANDLE:
    // there are too many such already.
    VkCommandBuffer joint(const std::vector<const Recording*>& parts);
    void forget(const Recording& part) noexcept;

    // LogicalDevice::kernel, as the instrument has it.
    std::shared_ptr<const Kernel> kernel(const Shader& shader,
                                         std::initializer_list<uint32_t> constants = {}) {
        return logical_->kernel(shader, constants, instrument_.rewrite);
    }
    // Before the first kernel of the logical device is made.
    void set_instrument(Instrument instrument) { instrument_ = std::move(instrument); }
    // Before the first stage is made: for tests of what other devices do.
    void set_wide(bool wide) { wide_ = wide; }
    const Instrument* instrument() const { return instrument_.rewrite ? &instrument_ : nullptr; }

    // Submits what every queue has pending and waits until it is done: then anything made from this
    // device may be destroyed. Others' work goes on. Never throws.
    void settle() noexcept;

  private:
    friend class Queue;
    friend class Buffer;
    void attach(Queue& queue);  // complete: settle flushes it from now on
    void detach(Queue& queue) noexcept;
    uint64_t next_serial() { return ++serials_; }
    template <class Record>
    void run_now(Record&& record);  // records, submits and waits

    std::shared_ptr<LogicalDevice> logical_;
    MemoryPool memory_;
    bool wide_;
    std::atomic<uint64_t> serials_{0};
    Buffer nothing_;
    Instrument instrument_;
    mutable std::mutex host_mutex_;
    std::map<const std::byte*, Buffer> host_;  // by where they begin
    std::mutex queue_mutex_;
    std::vector<Queue*> queues_;
    std::mutex joint_mutex_;
    std::vector<std::unique_ptr<JointRecording>> joints_;
};

}  // namespace defrec::vulkan
