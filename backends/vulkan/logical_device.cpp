// See logical_device.hpp; class Kernel: kernel.cpp.
#include "backends/vulkan/logical_device.hpp"

#include <algorithm>
#include <utility>

#include "backends/vulkan/check.hpp"

namespace defrec::vulkan {

constexpr uint32_t kMaxQueues = 8;

LogicalDevice::LogicalDevice(std::shared_ptr<const Driver> driver, size_t index)
    : driver_(std::move(driver)), index_(index) {
    const PhysicalDevice& chosen = physical();
    if (!chosen.lacks.empty())
        throw StageError(DEFREC_ERROR_UNSUPPORTED, chosen.name + " lacks " + chosen.lacks);
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(chosen.handle, &properties);
    limits_ = properties.limits;
    try {
        create(chosen);
    } catch (...) {
        destroy();
        throw;
    }
}

void LogicalDevice::create(const PhysicalDevice& chosen) {
    const uint32_t count = std::min(chosen.queue_count, kMaxQueues);
    const std::vector<float> priorities(count, 1.f);
    VkDeviceQueueCreateInfo queues{};
    queues.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queues.queueFamilyIndex = chosen.queue_family;
    queues.queueCount = count;
    queues.pQueuePriorities = priorities.data();

    VkPhysicalDeviceVulkan12Features v12{};
    v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    v12.timelineSemaphore = VK_TRUE;
    v12.storageBuffer8BitAccess = VK_TRUE;
    VkPhysicalDeviceVulkan11Features v11{};
    v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES;
    v11.pNext = &v12;
    v11.storageBuffer16BitAccess = VK_TRUE;
    VkPhysicalDeviceFeatures2 features{};
    features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    features.pNext = &v11;
    features.features.shaderInt64 = VK_TRUE;
    features.features.robustBufferAccess = VK_TRUE;  // every device has it

    VkPhysicalDeviceShaderIntegerDotProductFeatures dot{};
    dot.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SHADER_INTEGER_DOT_PRODUCT_FEATURES;
    dot.shaderIntegerDotProduct = VK_TRUE;
    std::vector<const char*> extensions;
    if (chosen.packed_dot) {
        extensions.push_back(VK_KHR_SHADER_INTEGER_DOT_PRODUCT_EXTENSION_NAME);
        v12.pNext = &dot;
    }

    VkDeviceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    info.pNext = &features;
    info.queueCreateInfoCount = 1;
    info.pQueueCreateInfos = &queues;
    info.enabledExtensionCount = uint32_t(extensions.size());
    info.ppEnabledExtensionNames = extensions.data();
    vulkan::check(vkCreateDevice(chosen.handle, &info, nullptr, &handle_), "vkCreateDevice");
    volkLoadDeviceTable(&vk_, handle_);
    for (uint32_t i = 0; i < count; ++i) {
        queues_.push_back(std::make_unique<HardwareQueue>());
        vk_.vkGetDeviceQueue(handle_, chosen.queue_family, i, &queues_.back()->handle);
    }
    VkPipelineCacheCreateInfo cache{};
    cache.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO;
    vulkan::check(vk_.vkCreatePipelineCache(handle_, &cache, nullptr, &pipeline_cache_),
                  "vkCreatePipelineCache");
}

void LogicalDevice::destroy() noexcept {
    if (handle_ == VK_NULL_HANDLE) return;
    kernels_.clear();
    if (pipeline_cache_ != VK_NULL_HANDLE)
        vk_.vkDestroyPipelineCache(handle_, pipeline_cache_, nullptr);
    vk_.vkDestroyDevice(handle_, nullptr);
}

std::shared_ptr<const Kernel> LogicalDevice::kernel(const Shader& shader,
                                                    const std::vector<uint32_t>& constants,
                                                    const Rewrite& rewrite) {
    const std::lock_guard lock(kernel_mutex_);
    std::shared_ptr<const Kernel>& kernel = kernels_[{shader.name, constants}];
    if (kernel == nullptr)
        kernel = std::make_shared<const Kernel>(*this, shader, constants, rewrite);
    return kernel;
}

LogicalDevice::HardwareQueue& LogicalDevice::acquire_queue() {
    const std::lock_guard lock(queue_mutex_);
    const auto& chosen = *std::min_element(
        queues_.begin(), queues_.end(),
        [](const auto& one, const auto& other) { return one->users < other->users; });
    ++chosen->users;
    return *chosen;
}

void LogicalDevice::release_queue(HardwareQueue& queue) noexcept {
    const std::lock_guard lock(queue_mutex_);
    --queue.users;
}

VkResult LogicalDevice::submit(HardwareQueue& queue, const VkSubmitInfo& info, VkFence fence) {
    if (lost_) return VK_ERROR_DEVICE_LOST;
    const std::lock_guard lock(queue.mutex);
    return vk_.vkQueueSubmit(queue.handle, 1, &info, fence);
}

void LogicalDevice::check(VkResult result, const char* call) {
    if (result == VK_ERROR_DEVICE_LOST) lost_ = true;
    vulkan::check(result, call);
}

}  // namespace defrec::vulkan
