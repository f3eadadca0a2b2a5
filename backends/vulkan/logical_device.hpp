// A VkDevice with its queues and pipelines. It outlives everything made from it.
#pragma once
#include <volk.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "backends/vulkan/driver.hpp"
#include "backends/vulkan/shader.hpp"

namespace defrec::vulkan {

class LogicalDevice;

// Gives a shader's code another form before it is compiled; empty: as it is.
using Rewrite = std::function<std::vector<uint32_t>(const Shader&)>;

// A shader with its constants, ready to run.
class Kernel {
  public:
    Kernel(const LogicalDevice& device, const Shader& shader, std::vector<uint32_t> constants,
           const Rewrite& rewrite);
    ~Kernel();
    Kernel(const Kernel&) = delete;
    Kernel& operator=(const Kernel&) = delete;

    VkPipeline pipeline() const { return pipeline_; }
    VkPipelineLayout layout() const { return layout_; }
    VkDescriptorSetLayout set_layout() const { return set_layout_; }
    uint32_t bindings() const { return uint32_t(written_.size()); }
    // Whether the shader may write to a buffer: all that are not declared readonly.
    bool writes(uint32_t binding) const { return written_[binding]; }
    const char* name() const { return name_; }

  private:
    void destroy();
    const LogicalDevice& device_;
    const char* name_;
    std::vector<bool> written_;
    VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkPipeline pipeline_ = VK_NULL_HANDLE;
};

constexpr uint32_t kPushBytes = 128;  // what every device has

// threads: any.
class LogicalDevice {
  public:
    // A queue of the device, which several users share.
    struct HardwareQueue {
        VkQueue handle = VK_NULL_HANDLE;
        std::mutex mutex;
        size_t users = 0;
    };

    // index: of driver->devices(). Throws StageError.
    LogicalDevice(std::shared_ptr<const Driver> driver, size_t index);
    ~LogicalDevice() { destroy(); }
    LogicalDevice(const LogicalDevice&) = delete;
    LogicalDevice& operator=(const LogicalDevice&) = delete;

    VkDevice handle() const { return handle_; }
    const VolkDeviceTable& vk() const { return vk_; }
    const std::shared_ptr<const Driver>& driver() const { return driver_; }
    const PhysicalDevice& physical() const { return driver_->devices()[index_]; }
    const VkPhysicalDeviceLimits& limits() const { return limits_; }
    // Whether packed dot products are there and right, as far as is known.
    bool packed_dot() const { return physical().packed_dot && !wrong_packed_dot_; }
    void distrust_packed_dot() { wrong_packed_dot_ = true; }
    VkPipelineCache pipeline_cache() const { return pipeline_cache_; }

    // The shader with constants, its specialization constants 0, 1, 2 ...; compiled once and kept
    // as long as the device. rewrite: the same in every call.
    std::shared_ptr<const Kernel> kernel(const Shader& shader,
                                         const std::vector<uint32_t>& constants,
                                         const Rewrite& rewrite);

    // The one that has the fewest users, and one more from now on.
    HardwareQueue& acquire_queue();
    void release_queue(HardwareQueue& queue) noexcept;
    VkResult submit(HardwareQueue& queue, const VkSubmitInfo& info, VkFence fence = VK_NULL_HANDLE);

    // As the function check, for calls that tell of a lost device.
    void check(VkResult result, const char* call);
    // Then it takes no more work, whoever's it is.
    bool lost() const { return lost_; }

  private:
    void create(const PhysicalDevice& physical);
    void destroy() noexcept;

    std::shared_ptr<const Driver> driver_;
    size_t index_;
    VkPhysicalDeviceLimits limits_;
    VkDevice handle_ = VK_NULL_HANDLE;
    VolkDeviceTable vk_{};
    VkPipelineCache pipeline_cache_ = VK_NULL_HANDLE;
    std::atomic<bool> lost_{false}, wrong_packed_dot_{false};

    std::mutex kernel_mutex_;
    std::map<std::pair<const char*, std::vector<uint32_t>>, std::shared_ptr<const Kernel>> kernels_;
    std::mutex queue_mutex_;  // of the queues' users
    std::vector<std::unique_ptr<HardwareQueue>> queues_;
};

}  // namespace defrec::vulkan
