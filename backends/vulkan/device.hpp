// An opened device: its functions, memory, pipelines and queues. It outlives everything made from
// it.
#pragma once
#include <volk.h>

#include <array>
#include <atomic>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "backends/vulkan/driver.hpp"
#include "backends/vulkan/memory.hpp"
#include "backends/vulkan/shader.hpp"

namespace defrec::vulkan {

class Device;
class Queue;

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

// A shader with its constants, ready to run.
class Kernel {
  public:
    Kernel(Device& device, const Shader& shader, std::vector<uint32_t> constants);
    ~Kernel();
    Kernel(const Kernel&) = delete;
    Kernel& operator=(const Kernel&) = delete;

    VkPipeline pipeline() const { return pipeline_; }
    VkPipelineLayout layout() const { return layout_; }
    VkDescriptorSetLayout set_layout() const { return set_layout_; }
    uint32_t bindings() const { return bindings_; }
    const char* name() const { return name_; }

  private:
    void destroy();
    Device& device_;
    const char* name_;
    uint32_t bindings_ = 0;
    VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkPipeline pipeline_ = VK_NULL_HANDLE;
};

constexpr uint32_t kPushBytes = 128;  // what every device has

// Changes shaders before they are compiled, so that they tell a test what they do: each then has
// one binding more, behind its own, for results.
struct Instrument {
    std::function<std::vector<uint32_t>(const Shader&)> rewrite;
    Buffer results;
};

// threads: any.
class Device {
  public:
    // index: of driver->devices(). Throws StageError.
    Device(std::shared_ptr<const Driver> driver, size_t index);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    VkDevice handle() const { return handle_; }
    const VolkDeviceTable& vk() const { return vk_; }
    const PhysicalDevice& physical() const { return driver_->devices()[index_]; }
    const VkPhysicalDeviceLimits& limits() const { return limits_; }
    MemoryPool& memory() { return *memory_; }

    // A buffer of the device with these bytes in it. Waits for the copy.
    Buffer upload(const void* data, uint64_t size);
    template <class T>
    Buffer upload(const std::vector<T>& values) {
        return upload(values.data(), values.size() * sizeof(T));
    }
    // Zeroes a buffer that nothing uses yet, and waits.
    void clear(const Buffer& buffer);
    // Stands for an optional buffer that was not given.
    const Buffer& nothing() const { return nothing_; }

    // The shader with constants, its specialization constants 0, 1, 2 ...; compiled once and kept
    // as long as the device.
    std::shared_ptr<const Kernel> kernel(const Shader& shader,
                                         std::initializer_list<uint32_t> constants = {});
    VkPipelineCache pipeline_cache() const { return pipeline_cache_; }
    // Before the first kernel is made.
    void set_instrument(Instrument instrument) { instrument_ = std::move(instrument); }
    const Instrument* instrument() const { return instrument_.rewrite ? &instrument_ : nullptr; }

    // Submits what every queue has pending and waits until the device is idle: then anything may be
    // destroyed. Never throws.
    void settle() noexcept;

  private:
    friend class Queue;
    friend class Buffer;
    // The device's queues are shared by ours; each with the lock that its use needs.
    struct SharedQueue {
        VkQueue handle = VK_NULL_HANDLE;
        std::mutex mutex;
    };
    void create(const PhysicalDevice& physical);
    void destroy() noexcept;
    SharedQueue& next_shared_queue();  // in turn
    void attach(Queue& queue);         // complete: settle flushes it from now on
    void detach(Queue& queue) noexcept;
    uint64_t next_serial() { return ++serials_; }
    template <class Record>
    void run_now(Record&& record);  // records, submits and waits

    std::shared_ptr<const Driver> driver_;
    size_t index_;
    VkPhysicalDeviceLimits limits_;
    VkDevice handle_ = VK_NULL_HANDLE;
    VolkDeviceTable vk_{};
    std::unique_ptr<MemoryPool> memory_;
    VkPipelineCache pipeline_cache_ = VK_NULL_HANDLE;
    Buffer nothing_;
    Instrument instrument_;

    std::mutex kernel_mutex_;
    std::map<std::pair<const char*, std::vector<uint32_t>>, std::shared_ptr<const Kernel>> kernels_;
    std::mutex queue_mutex_;
    std::vector<std::unique_ptr<SharedQueue>> shared_queues_;
    std::vector<Queue*> queues_;
    size_t shares_ = 0;  // given out by next_shared_queue
    std::atomic<uint64_t> serials_{0};
};

}  // namespace defrec::vulkan
