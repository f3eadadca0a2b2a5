// See device.hpp.
#include "backends/vulkan/device.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "backends/vulkan/check.hpp"
#include "backends/vulkan/queue.hpp"

namespace defrec::vulkan {
namespace {

constexpr uint32_t kMaxQueues = 8;
constexpr uint64_t kBufferMultiple =
    16;  // so that shaders may read and the device may copy whole words

}  // namespace

// ---- buffers ----------------------------------------------------------------

Buffer::Buffer(Device& device, uint64_t size, MemoryUse use)
    : device_(&device), size_(size), serial_(device.next_serial()) {
    // Shaders count bytes in int.
    const uint64_t maximum = std::min(device.limits().maxStorageBufferRange, uint32_t{INT32_MAX}) /
                             kBufferMultiple * kBufferMultiple;
    if (use == MemoryUse::device && size > maximum)
        throw StageError(DEFREC_ERROR_UNSUPPORTED, "a buffer of " + std::to_string(size) +
                                                       " bytes; the device's shaders reach " +
                                                       std::to_string(maximum));
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.size =
        (std::max<uint64_t>(size, 1) + kBufferMultiple - 1) / kBufferMultiple * kBufferMultiple;
    info.usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    if (use == MemoryUse::device)
        info.usage |= VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT;
    const VolkDeviceTable& vk = device.vk();
    check(vk.vkCreateBuffer(device.handle(), &info, nullptr, &handle_), "vkCreateBuffer");
    try {
        VkMemoryRequirements requirements;
        vk.vkGetBufferMemoryRequirements(device.handle(), handle_, &requirements);
        range_ = device.memory().allocate(requirements, use);
        check(vk.vkBindBufferMemory(device.handle(), handle_, range_.memory, range_.offset),
              "vkBindBufferMemory");
    } catch (...) {
        if (range_.block != nullptr) device.memory().release(range_);
        vk.vkDestroyBuffer(device.handle(), handle_, nullptr);
        throw;
    }
}

Buffer::~Buffer() {
    if (handle_ == VK_NULL_HANDLE) return;
    device_->vk().vkDestroyBuffer(device_->handle(), handle_, nullptr);
    device_->memory().release(range_);
}

void Buffer::swap(Buffer& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(handle_, other.handle_);
    std::swap(range_, other.range_);
    std::swap(size_, other.size_);
    std::swap(serial_, other.serial_);
}

// ---- device -----------------------------------------------------------------

Device::Device(std::shared_ptr<const Driver> driver, size_t index)
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

void Device::create(const PhysicalDevice& chosen) {
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

    VkDeviceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    info.pNext = &features;
    info.queueCreateInfoCount = 1;
    info.pQueueCreateInfos = &queues;
    check(vkCreateDevice(chosen.handle, &info, nullptr, &handle_), "vkCreateDevice");
    volkLoadDeviceTable(&vk_, handle_);
    memory_ = std::make_unique<MemoryPool>(chosen.handle, handle_, vk_);
    for (uint32_t i = 0; i < count; ++i) {
        shared_queues_.push_back(std::make_unique<SharedQueue>());
        vk_.vkGetDeviceQueue(handle_, chosen.queue_family, i, &shared_queues_.back()->handle);
    }
    VkPipelineCacheCreateInfo cache{};
    cache.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO;
    check(vk_.vkCreatePipelineCache(handle_, &cache, nullptr, &pipeline_cache_),
          "vkCreatePipelineCache");
    nothing_ = Buffer(*this, kBufferMultiple);
    clear(nothing_);
}

void Device::destroy() noexcept {
    if (handle_ == VK_NULL_HANDLE) return;
    nothing_ = Buffer();
    instrument_ = {};
    kernels_.clear();
    if (pipeline_cache_ != VK_NULL_HANDLE)
        vk_.vkDestroyPipelineCache(handle_, pipeline_cache_, nullptr);
    memory_.reset();
    vk_.vkDestroyDevice(handle_, nullptr);
}

Device::~Device() {
    settle();
    destroy();
}

std::shared_ptr<const Kernel> Device::kernel(const Shader& shader,
                                             std::initializer_list<uint32_t> constants) {
    const std::lock_guard lock(kernel_mutex_);
    std::shared_ptr<const Kernel>& kernel = kernels_[{shader.name, constants}];
    if (kernel == nullptr) kernel = std::make_shared<const Kernel>(*this, shader, constants);
    return kernel;
}

Device::SharedQueue& Device::next_shared_queue() {
    const std::lock_guard lock(queue_mutex_);
    return *shared_queues_[shares_++ % shared_queues_.size()];
}

void Device::attach(Queue& queue) {
    const std::lock_guard lock(queue_mutex_);
    queues_.push_back(&queue);
}

void Device::detach(Queue& queue) noexcept {
    const std::lock_guard lock(queue_mutex_);
    std::erase(queues_, &queue);
}

void Device::settle() noexcept {
    const std::lock_guard lock(queue_mutex_);
    for (Queue* queue : queues_) queue->flush_pending();
    for (const auto& shared : shared_queues_) {
        const std::lock_guard submit_lock(shared->mutex);
        vk_.vkQueueWaitIdle(shared->handle);  // a lost device is idle too
    }
}

// ---- work that is waited for ------------------------------------------------

template <class Record>
void Device::run_now(Record&& record) {
    VkCommandPoolCreateInfo pool_info{};
    pool_info.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool_info.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
    pool_info.queueFamilyIndex = physical().queue_family;
    VkCommandPool pool = VK_NULL_HANDLE;
    check(vk_.vkCreateCommandPool(handle_, &pool_info, nullptr, &pool), "vkCreateCommandPool");
    try {
        VkCommandBufferAllocateInfo allocate{};
        allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
        allocate.commandPool = pool;
        allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
        allocate.commandBufferCount = 1;
        VkCommandBuffer commands = VK_NULL_HANDLE;
        check(vk_.vkAllocateCommandBuffers(handle_, &allocate, &commands),
              "vkAllocateCommandBuffers");
        VkCommandBufferBeginInfo begin{};
        begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
        begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
        check(vk_.vkBeginCommandBuffer(commands, &begin), "vkBeginCommandBuffer");
        record(commands);
        check(vk_.vkEndCommandBuffer(commands), "vkEndCommandBuffer");
        VkSubmitInfo submit{};
        submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
        submit.commandBufferCount = 1;
        submit.pCommandBuffers = &commands;
        SharedQueue& queue = *shared_queues_[0];
        const std::lock_guard lock(queue.mutex);
        check(vk_.vkQueueSubmit(queue.handle, 1, &submit, VK_NULL_HANDLE), "vkQueueSubmit");
        check(vk_.vkQueueWaitIdle(queue.handle), "vkQueueWaitIdle");
    } catch (...) {
        vk_.vkDestroyCommandPool(handle_, pool, nullptr);
        throw;
    }
    vk_.vkDestroyCommandPool(handle_, pool, nullptr);
}

Buffer Device::upload(const void* data, uint64_t size) {
    Buffer buffer(*this, size);
    if (size == 0) return buffer;
    const Buffer staging(*this, size, MemoryUse::upload);
    std::memcpy(staging.mapped(), data, size);
    run_now([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, 0, size};
        vk_.vkCmdCopyBuffer(commands, staging.handle(), buffer.handle(), 1, &region);
    });
    return buffer;
}

void Device::clear(const Buffer& buffer) {
    run_now([&](VkCommandBuffer commands) {
        vk_.vkCmdFillBuffer(commands, buffer.handle(), 0, VK_WHOLE_SIZE, 0);
    });
}

}  // namespace defrec::vulkan
