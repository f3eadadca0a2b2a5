// See queue.hpp.
#include "backends/vulkan/queue.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "backends/vulkan/check.hpp"
#include "backends/vulkan/recorder.hpp"

namespace defrec::vulkan {

constexpr size_t kMaxJoint = 32;         // recordings in one command buffer
constexpr uint64_t kLookNs = 4'000'000;  // how long a wait looks before it sleeps: about a frame

Queue::Queue(Device& device)
    : device_(device), vk_(device.vk()), shared_(device.logical().acquire_queue()) {
    VkSemaphoreTypeCreateInfo type{};
    type.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO;
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    VkSemaphoreCreateInfo semaphore{};
    semaphore.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
    semaphore.pNext = &type;
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.flags =
        VK_COMMAND_POOL_CREATE_TRANSIENT_BIT | VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    pool.queueFamilyIndex = device.physical().queue_family;
    try {
        check(vk_.vkCreateSemaphore(device.handle(), &semaphore, nullptr, &semaphore_),
              "vkCreateSemaphore");
        check(vk_.vkCreateCommandPool(device.handle(), &pool, nullptr, &pool_),
              "vkCreateCommandPool");
        device.attach(*this);
    } catch (...) {
        destroy();
        throw;
    }
}

Queue::~Queue() {
    settle();
    // Reads that nobody waited for stay undone: after a failure their destinations may be gone.
    destroy();
}

void Queue::destroy() noexcept {
    device_.detach(*this);
    device_.logical().release_queue(shared_);
    vk_.vkDestroyCommandPool(device_.handle(), pool_, nullptr);
    vk_.vkDestroySemaphore(device_.handle(), semaphore_, nullptr);
}

void Queue::run(const Recording& recording) {
    const std::lock_guard lock(mutex_);
    close_copies();
    if (runs_.size() == kMaxJoint) close_runs();
    runs_.push_back(&recording);
}

void Queue::write(const Buffer& buffer, uint64_t offset, const void* src, uint64_t size) {
    if (size == 0) return;
    const std::lock_guard lock(mutex_);
    const HostStaging::Slot& from = take(upload_, size, MemoryUse::upload);
    std::memcpy(from.bytes(), src, size);
    copy(from.buffer, 0, buffer, offset, size);
}

void Queue::write_in_place(const Buffer& buffer, uint64_t offset, const void* src, uint64_t size) {
    const Device::HostRange from = device_.find_host(src, size);
    if (size == 0 || from.buffer == nullptr) return write(buffer, offset, src, size);
    const std::lock_guard lock(mutex_);
    copy(*from.buffer, from.offset, buffer, offset, size);
}

void Queue::read(const Buffer& buffer, uint64_t offset, void* dst, uint64_t size) {
    if (size == 0) return;
    const Device::HostRange there = device_.find_host(dst, size);
    const std::lock_guard lock(mutex_);
    if (there.buffer != nullptr) return copy(buffer, offset, *there.buffer, there.offset, size);
    HostStaging::Slot& to = take(download_, size, MemoryUse::download);
    copy(buffer, offset, to.buffer, 0, size);
    download_.deliver_later(to, dst, size);
}

void Queue::forget_read(const void* dst) {
    const std::lock_guard lock(mutex_);
    download_.forget(dst);
}

uint64_t Queue::signal() {
    const std::lock_guard lock(mutex_);
    if (flush_failure_ != nullptr) {
        close_copies();
        drop_pending();
        std::rethrow_exception(std::exchange(flush_failure_, nullptr));
    }
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
    const auto start = Clock::now();
    look_for(value, start + std::chrono::nanoseconds(std::min(timeout_ns, kLookNs)));
    const auto looked =
        static_cast<uint64_t>(std::chrono::nanoseconds(Clock::now() - start).count());
    const VkResult result =
        vk_.vkWaitSemaphores(device_.handle(), &info, timeout_ns - std::min(timeout_ns, looked));
    device_.logical().check(result, "vkWaitSemaphores");
    if (result == VK_TIMEOUT) return false;
    const std::lock_guard lock(mutex_);
    download_.deliver(value);
    return true;
}

// Waking a thread costs a good part of a short wait; where the device is the processor itself,
// looking would take its time.
void Queue::look_for(uint64_t value, Clock::time_point end) {
    if (device_.physical().software) return;
    while (completed() < value && Clock::now() < end) std::this_thread::yield();
}

uint64_t Queue::completed() {
    uint64_t value = 0;
    device_.logical().check(vk_.vkGetSemaphoreCounterValue(device_.handle(), semaphore_, &value),
                            "vkGetSemaphoreCounterValue");
    return value;
}

Queue::HostStaging::Slot& Queue::take(HostStaging& staging, uint64_t size, MemoryUse use) {
    return staging.take(size, completed(), submitted_ + 1,
                        [&](uint64_t at_least) { return Buffer(device_, at_least, use); });
}

VkCommandBuffer Queue::copies() {
    if (open_ != VK_NULL_HANDLE) return open_;
    close_runs();
    const uint64_t done = completed();
    auto free = std::find_if(transients_.begin(), transients_.end(),
                             [&](const Transient& t) { return t.busy_until <= done; });
    if (free == transients_.end()) {
        VkCommandBufferAllocateInfo allocate{};
        allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
        allocate.commandPool = pool_;
        allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
        allocate.commandBufferCount = 1;
        VkCommandBuffer commands = VK_NULL_HANDLE;
        check(vk_.vkAllocateCommandBuffers(device_.handle(), &allocate, &commands),
              "vkAllocateCommandBuffers");
        free = transients_.insert(transients_.end(), {commands, 0});
    }
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check(vk_.vkBeginCommandBuffer(free->commands, &begin), "vkBeginCommandBuffer");
    free->busy_until = submitted_ + 1;
    return open_ = free->commands;
}

// Copies that have nothing in common run beside each other.
void Queue::copy(const Buffer& from, uint64_t from_offset, const Buffer& to, uint64_t to_offset,
                 uint64_t size) {
    const bool is_first = open_ == VK_NULL_HANDLE;
    VkCommandBuffer commands = copies();
    const Range source{from.serial(), from_offset, from_offset + size},
        target{to.serial(), to_offset, to_offset + size};
    const auto touches = [](const std::vector<Range>& ranges, const Range& range) {
        return std::any_of(ranges.begin(), ranges.end(), [&](const Range& other) {
            return other.serial == range.serial && other.begin < range.end &&
                   range.begin < other.end;
        });
    };
    if (is_first || touches(copied_to_, source) || touches(copied_to_, target) ||
        touches(copied_from_, target)) {
        record_barrier(vk_, commands);
        copied_from_.clear();
        copied_to_.clear();
    }
    copied_from_.push_back(source);
    copied_to_.push_back(target);
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
    vk_.vkCmdPipelineBarrier(open_, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0,
                             1, &barrier, 0, nullptr, 0, nullptr);
    const VkResult result = vk_.vkEndCommandBuffer(open_);
    const VkCommandBuffer closed = std::exchange(open_, VK_NULL_HANDLE);
    if (result != VK_SUCCESS) drop_pending();
    check(result, "vkEndCommandBuffer");
    pending_.push_back(closed);
}

void Queue::close_runs() {
    bool known = runs_.size() > 1;
    for (const Recording* recording : runs_) known = recording->ran_before() && known;
    const VkCommandBuffer joint = known ? device_.joint(runs_) : VK_NULL_HANDLE;
    if (joint != VK_NULL_HANDLE)
        pending_.push_back(joint);
    else
        for (const Recording* recording : runs_) pending_.push_back(recording->commands());
    runs_.clear();
}

void Queue::submit() {
    close_copies();
    try {
        close_runs();
    } catch (...) {
        drop_pending();
        throw;
    }
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
    const VkResult result = device_.logical().submit(shared_, info);
    if (result != VK_SUCCESS) drop_pending();
    device_.logical().check(result, "vkQueueSubmit");
    pending_.clear();
    submitted_ = value;
}

// What has gathered will not run.
void Queue::drop_pending() noexcept {
    pending_.clear();
    runs_.clear();
    download_.drop_after(submitted_);
}

// Work that the device does not take is none to wait for; but whoever gathered it must hear of it.
void Queue::flush_pending() noexcept {
    const std::lock_guard lock(mutex_);
    try {
        if (open_ != VK_NULL_HANDLE || !runs_.empty() || !pending_.empty()) submit();
    } catch (const std::exception&) {
        flush_failure_ = std::current_exception();
    }
}

// Only for its own work: the hardware's queue may have that of others.
void Queue::settle() noexcept {
    flush_pending();
    uint64_t value;
    {
        const std::lock_guard lock(mutex_);
        value = submitted_;
    }
    VkSemaphoreWaitInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO;
    info.semaphoreCount = 1;
    info.pSemaphores = &semaphore_;
    info.pValues = &value;
    vk_.vkWaitSemaphores(device_.handle(), &info, UINT64_MAX);  // a lost device is idle too
}

}  // namespace defrec::vulkan
