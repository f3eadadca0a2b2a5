// See device.hpp.
#include "backends/vulkan/device.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "backends/vulkan/check.hpp"
#include "backends/vulkan/queue.hpp"
#include "backends/vulkan/recorder.hpp"

namespace defrec::vulkan {
namespace {

constexpr size_t kMaxJoints = 32;
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
    if (size > UINT64_MAX - kBufferMultiple)
        throw StageError(DEFREC_ERROR_OUT_OF_MEMORY,
                         "a buffer of " + std::to_string(size) + " bytes, beyond any memory");
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

Device::Device(std::shared_ptr<LogicalDevice> logical)
    : logical_(std::move(logical)),
      memory_(physical().handle, handle(), vk()),
      wide_(!physical().software && logical_->packed_dot()),
      nothing_(*this, kBufferMultiple) {
    clear(nothing_);
}

Device::~Device() { settle(); }

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
    for (Queue* queue : queues_) queue->settle();
}

// ---- recordings -------------------------------------------------------------

VkCommandBuffer Device::joint(const std::vector<const Recording*>& parts) {
    const std::lock_guard lock(joint_mutex_);
    const auto known = std::find_if(joints_.begin(), joints_.end(), [&](const auto& joint) {
        return std::equal(parts.begin(), parts.end(), joint->parts().begin(), joint->parts().end());
    });
    if (known != joints_.end()) return (*known)->commands();
    if (joints_.size() == kMaxJoints) return VK_NULL_HANDLE;
    joints_.push_back(std::make_unique<JointRecording>(*this, parts));
    return joints_.back()->commands();
}

void Device::forget(const Recording& part) noexcept {
    const std::lock_guard lock(joint_mutex_);
    std::erase_if(joints_, [&](const auto& joint) {
        return std::find(joint->parts().begin(), joint->parts().end(), &part) !=
               joint->parts().end();
    });
}

// ---- memory of the host ------------------------------------------------------

void* Device::allocate_host(uint64_t size) {
    Buffer buffer(*this, size, MemoryUse::host);
    std::byte* memory = buffer.mapped();
    std::memset(memory, 0, size);
    const std::lock_guard lock(host_mutex_);
    host_.emplace(memory, std::move(buffer));
    return memory;
}

void Device::release_host(void* memory) noexcept {
    const std::lock_guard lock(host_mutex_);
    host_.erase(static_cast<const std::byte*>(memory));
}

Device::HostRange Device::find_host(const void* memory, uint64_t size) const {
    const auto* begin = static_cast<const std::byte*>(memory);
    const std::lock_guard lock(host_mutex_);
    auto found = host_.upper_bound(begin);
    if (found == host_.begin()) return {};
    --found;
    const auto offset = static_cast<uint64_t>(begin - found->first);
    const uint64_t there = found->second.size();
    if (offset > there || size > there - offset) return {};
    return {&found->second, offset};
}

// ---- work that is waited for ------------------------------------------------

template <class Record>
void Device::run_now(Record&& record) {
    const VolkDeviceTable& vk = this->vk();
    VkCommandPoolCreateInfo pool_info{};
    pool_info.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool_info.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
    pool_info.queueFamilyIndex = physical().queue_family;
    VkFenceCreateInfo fence_info{};
    fence_info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    struct Used {
        const Device& device;
        VkCommandPool pool = VK_NULL_HANDLE;
        VkFence fence = VK_NULL_HANDLE;
        LogicalDevice::HardwareQueue& queue = device.logical().acquire_queue();
        ~Used() {
            device.logical().release_queue(queue);
            device.vk().vkDestroyFence(device.handle(), fence, nullptr);
            device.vk().vkDestroyCommandPool(device.handle(), pool, nullptr);
        }
    } used{*this};
    check(vk.vkCreateCommandPool(handle(), &pool_info, nullptr, &used.pool), "vkCreateCommandPool");
    check(vk.vkCreateFence(handle(), &fence_info, nullptr, &used.fence), "vkCreateFence");
    VkCommandBufferAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    allocate.commandPool = used.pool;
    allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    allocate.commandBufferCount = 1;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    check(vk.vkAllocateCommandBuffers(handle(), &allocate, &commands), "vkAllocateCommandBuffers");
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check(vk.vkBeginCommandBuffer(commands, &begin), "vkBeginCommandBuffer");
    record(commands);
    check(vk.vkEndCommandBuffer(commands), "vkEndCommandBuffer");
    VkSubmitInfo submit{};
    submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands;
    logical_->check(logical_->submit(used.queue, submit, used.fence), "vkQueueSubmit");
    logical_->check(vk.vkWaitForFences(handle(), 1, &used.fence, VK_TRUE, UINT64_MAX),
                    "vkWaitForFences");
}

Buffer Device::upload(const void* data, uint64_t size) {
    Buffer buffer(*this, size);
    if (size == 0) return buffer;
    const Buffer staging(*this, size, MemoryUse::upload);
    std::memcpy(staging.mapped(), data, size);
    run_now([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, 0, size};
        vk().vkCmdCopyBuffer(commands, staging.handle(), buffer.handle(), 1, &region);
    });
    return buffer;
}

void Device::clear(const Buffer& buffer) {
    run_now([&](VkCommandBuffer commands) {
        vk().vkCmdFillBuffer(commands, buffer.handle(), 0, VK_WHOLE_SIZE, 0);
    });
}

}  // namespace defrec::vulkan
