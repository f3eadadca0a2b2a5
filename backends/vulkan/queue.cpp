// See queue.hpp.
#include "backends/vulkan/queue.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "backends/vulkan/check.hpp"
#include "backends/vulkan/recorder.hpp"

namespace defrec::vulkan {

using Clock = std::chrono::steady_clock;

constexpr uint64_t kLeastStaging = 4096;
constexpr uint64_t kLookNs = 4'000'000;  // how long a wait looks before it sleeps: about a frame

Queue::Queue(Device& device) : device_(device), vk_(device.vk()), shared_(device.attach(*this)) {
    VkSemaphoreTypeCreateInfo type{};
    type.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO;
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    VkSemaphoreCreateInfo semaphore{};
    semaphore.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
    semaphore.pNext = &type;
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT | VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    pool.queueFamilyIndex = device.physical().queue_family;
    try {
        check(vk_.vkCreateSemaphore(device.handle(), &semaphore, nullptr, &semaphore_), "vkCreateSemaphore");
        check(vk_.vkCreateCommandPool(device.handle(), &pool, nullptr, &pool_), "vkCreateCommandPool");
    } catch (...) {
        destroy();
        throw;
    }
}

Queue::~Queue() {
    flush_pending();
    {
        const std::lock_guard lock(shared_.mutex);
        vk_.vkQueueWaitIdle(shared_.handle);
    }
    // Reads that nobody waited for stay undone: after a failure their destinations may be gone.
    destroy();
}

void Queue::destroy() noexcept {
    device_.detach(*this);
    vk_.vkDestroyCommandPool(device_.handle(), pool_, nullptr);
    vk_.vkDestroySemaphore(device_.handle(), semaphore_, nullptr);
}

void Queue::run(VkCommandBuffer commands) {
    const std::lock_guard lock(mutex_);
    close_copies();
    pending_.push_back(commands);
}

void Queue::write(const Buffer& buffer, uint64_t offset, const void* src, uint64_t size) {
    if (size == 0) return;
    const std::lock_guard lock(mutex_);
    const Buffer& from = upload_[staging(upload_, size, MemoryUse::upload)].buffer;
    std::memcpy(from.mapped(), src, size);
    copy(from, 0, buffer, offset, size);
}

void Queue::read(const Buffer& buffer, uint64_t offset, void* dst, uint64_t size) {
    if (size == 0) return;
    const std::lock_guard lock(mutex_);
    const size_t to = staging(download_, size, MemoryUse::download);
    // Until its bytes are delivered, not only until they are copied.
    download_[to].busy_until = UINT64_MAX;
    copy(buffer, offset, download_[to].buffer, 0, size);
    reads_.push_back({to, dst, size, submitted_ + 1});
}

uint64_t Queue::signal() {
    const std::lock_guard lock(mutex_);
    submit();
    return submitted_;
}

bool Queue::wait(uint64_t value, uint64_t timeout_ns) {
    {
        const std::lock_guard lock(mutex_);
        if (value > submitted_) return false;
    }
    VkSemaphoreWaitInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO;
    info.semaphoreCount = 1;
    info.pSemaphores = &semaphore_;
    info.pValues = &value;
    look_for(value, timeout_ns);
    const VkResult result = vk_.vkWaitSemaphores(device_.handle(), &info, timeout_ns);
    check(result, "vkWaitSemaphores");
    if (result == VK_TIMEOUT) return false;
    const std::lock_guard lock(mutex_);
    deliver(value);
    return true;
}

// Waking a thread costs a good part of a short wait; where the device is the processor itself, looking would take its time.
void Queue::look_for(uint64_t value, uint64_t timeout_ns) {
    if (device_.physical().software) return;
    const auto end = Clock::now() + std::chrono::nanoseconds(std::min(timeout_ns, kLookNs));
    while (completed() < value && Clock::now() < end) std::this_thread::yield();
}

void Queue::deliver(uint64_t value) {
    std::erase_if(reads_, [&](const PendingRead& read) {
        if (read.value > value) return false;
        std::memcpy(read.dst, download_[read.staging].buffer.mapped(), read.size);
        download_[read.staging].busy_until = 0;
        return true;
    });
}

uint64_t Queue::completed() {
    uint64_t value = 0;
    check(vk_.vkGetSemaphoreCounterValue(device_.handle(), semaphore_, &value), "vkGetSemaphoreCounterValue");
    return value;
}

// The smallest free buffer that is large enough; a new one where there is none, which ends once a frame has been through.
size_t Queue::staging(std::vector<Staging>& pool, uint64_t size, MemoryUse use) {
    const uint64_t done = completed();
    size_t best = pool.size();
    for (size_t i = 0; i < pool.size(); ++i)
        if (pool[i].busy_until <= done && pool[i].buffer.size() >= size &&
            (best == pool.size() || pool[i].buffer.size() < pool[best].buffer.size()))
            best = i;
    if (best == pool.size()) pool.push_back({Buffer(device_, std::bit_ceil(std::max(size, kLeastStaging)), use), 0});
    pool[best].busy_until = submitted_ + 1;
    return best;
}

VkCommandBuffer Queue::copies() {
    if (open_ != VK_NULL_HANDLE) return open_;
    const uint64_t done = completed();
    auto free = std::find_if(transients_.begin(), transients_.end(), [&](const Transient& t) { return t.busy_until <= done; });
    if (free == transients_.end()) {
        VkCommandBufferAllocateInfo allocate{};
        allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
        allocate.commandPool = pool_;
        allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
        allocate.commandBufferCount = 1;
        VkCommandBuffer commands = VK_NULL_HANDLE;
        check(vk_.vkAllocateCommandBuffers(device_.handle(), &allocate, &commands), "vkAllocateCommandBuffers");
        free = transients_.insert(transients_.end(), {commands, 0});
    }
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check(vk_.vkBeginCommandBuffer(free->commands, &begin), "vkBeginCommandBuffer");
    free->busy_until = submitted_ + 1;
    return open_ = free->commands;
}

void Queue::copy(const Buffer& from, uint64_t from_offset, const Buffer& to, uint64_t to_offset, uint64_t size) {
    VkCommandBuffer commands = copies();
    record_barrier(vk_, commands);
    const VkBufferCopy region{from_offset, to_offset, size};
    vk_.vkCmdCopyBuffer(commands, from.handle(), to.handle(), 1, &region);
}

void Queue::close_copies() {
    if (open_ == VK_NULL_HANDLE) return;
    // What the host reads needs its own visibility; it costs nothing where nothing was read.
    VkMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
    barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
    vk_.vkCmdPipelineBarrier(open_, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier, 0, nullptr, 0, nullptr);
    const VkResult result = vk_.vkEndCommandBuffer(open_);
    const VkCommandBuffer closed = std::exchange(open_, VK_NULL_HANDLE);
    check(result, "vkEndCommandBuffer");
    pending_.push_back(closed);
}

void Queue::submit() {
    close_copies();
    const uint64_t value = submitted_ + 1;
    VkTimelineSemaphoreSubmitInfo timeline{};
    timeline.sType = VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO;
    timeline.signalSemaphoreValueCount = 1;
    timeline.pSignalSemaphoreValues = &value;
    VkSubmitInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    info.pNext = &timeline;
    info.commandBufferCount = static_cast<uint32_t>(pending_.size());
    info.pCommandBuffers = pending_.data();
    info.signalSemaphoreCount = 1;
    info.pSignalSemaphores = &semaphore_;
    VkResult result;
    {
        const std::lock_guard lock(shared_.mutex);
        result = vk_.vkQueueSubmit(shared_.handle, 1, &info, VK_NULL_HANDLE);
    }
    pending_.clear();
    check(result, "vkQueueSubmit");
    submitted_ = value;
}

void Queue::flush_pending() noexcept {
    try {
        const std::lock_guard lock(mutex_);
        if (open_ != VK_NULL_HANDLE || !pending_.empty()) submit();
    } catch (const std::exception&) {
        // A device that takes no work any more has none to wait for.
    }
}

}  // namespace defrec::vulkan
