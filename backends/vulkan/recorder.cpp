// See recorder.hpp.
#include "backends/vulkan/recorder.hpp"

#include <array>

#include "backends/vulkan/check.hpp"

namespace defrec::vulkan {

constexpr uint32_t kSetsPerPool = 32, kBuffersPerPool = 256;

Recording::Recording(Device& device) : device_(device) {
    const VolkDeviceTable& vk = device.vk();
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.queueFamilyIndex = device.physical().queue_family;
    check(vk.vkCreateCommandPool(device.handle(), &pool, nullptr, &pool_), "vkCreateCommandPool");
    VkCommandBufferAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    allocate.commandPool = pool_;
    allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    allocate.commandBufferCount = 1;
    const VkResult result = vk.vkAllocateCommandBuffers(device.handle(), &allocate, &commands_);
    if (result != VK_SUCCESS) vk.vkDestroyCommandPool(device.handle(), pool_, nullptr);
    check(result, "vkAllocateCommandBuffers");
}

Recording::~Recording() {
    const VolkDeviceTable& vk = device_.vk();
    for (VkDescriptorPool pool : descriptor_pools_)
        vk.vkDestroyDescriptorPool(device_.handle(), pool, nullptr);
    vk.vkDestroyCommandPool(device_.handle(), pool_, nullptr);
}

void Recording::add_descriptor_pool() {
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, kBuffersPerPool};
    VkDescriptorPoolCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    info.maxSets = kSetsPerPool;
    info.poolSizeCount = 1;
    info.pPoolSizes = &size;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    check(device_.vk().vkCreateDescriptorPool(device_.handle(), &info, nullptr, &pool),
          "vkCreateDescriptorPool");
    descriptor_pools_.push_back(pool);
}

VkDescriptorSet Recording::descriptor_set(const Kernel& kernel,
                                          std::initializer_list<Binding> bindings) {
    const VolkDeviceTable& vk = device_.vk();
    const VkDescriptorSetLayout layout = kernel.set_layout();
    VkDescriptorSetAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    info.descriptorSetCount = 1;
    info.pSetLayouts = &layout;
    VkDescriptorSet set = VK_NULL_HANDLE;
    VkResult result = VK_ERROR_OUT_OF_POOL_MEMORY;
    for (int attempt = 0; attempt < 2 && result != VK_SUCCESS; ++attempt) {
        if (attempt == 1 || descriptor_pools_.empty()) add_descriptor_pool();
        info.descriptorPool = descriptor_pools_.back();
        result = vk.vkAllocateDescriptorSets(device_.handle(), &info, &set);
    }
    check(result, "vkAllocateDescriptorSets");

    std::array<VkDescriptorBufferInfo, 32> buffers;
    std::array<VkWriteDescriptorSet, 32> writes;
    uint32_t count = 0;
    const auto write = [&](const Buffer& buffer) {
        buffers[count] = {buffer.handle(), 0, VK_WHOLE_SIZE};
        writes[count] = {};
        writes[count].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[count].dstSet = set;
        writes[count].dstBinding = count;
        writes[count].descriptorCount = 1;
        writes[count].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        writes[count].pBufferInfo = &buffers[count];
        ++count;
    };
    for (const Binding& binding : bindings)
        write(binding.buffer == nullptr ? device_.nothing() : *binding.buffer);
    if (device_.instrument() != nullptr) write(device_.instrument()->results);
    vk.vkUpdateDescriptorSets(device_.handle(), count, writes.data(), 0, nullptr);
    return set;
}

Recorder::Recorder(Recording& recording) : recording_(recording), vk_(recording.device_.vk()) {
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_SIMULTANEOUS_USE_BIT;  // a frame may be queued before the
                                                                 // last one is done
    check(vk_.vkBeginCommandBuffer(recording_.commands(), &begin), "vkBeginCommandBuffer");
}

void Recorder::finish() {
    check(vk_.vkEndCommandBuffer(recording_.commands()), "vkEndCommandBuffer");
}

void Recorder::bind(const std::shared_ptr<const Kernel>& kernel,
                    std::initializer_list<Binding> bindings, const void* push, uint32_t push_size) {
    const size_t expected =
        kernel->bindings() - (recording_.device_.instrument() != nullptr ? 1 : 0);
    if (bindings.size() != expected)
        throw StageError(DEFREC_ERROR_INTERNAL, std::string("shader ") + kernel->name() + " has " +
                                                    std::to_string(expected) + " buffers, " +
                                                    std::to_string(bindings.size()) + " given");
    const VkDescriptorSet set = recording_.descriptor_set(*kernel, bindings);
    recording_.kernels_.push_back(kernel);
    VkCommandBuffer commands = recording_.commands();
    vk_.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel->pipeline());
    vk_.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel->layout(), 0, 1,
                                &set, 0, nullptr);
    vk_.vkCmdPushConstants(commands, kernel->layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, push_size,
                           push);
}

void Recorder::barrier() { record_barrier(vk_, recording_.commands()); }

void Recorder::copy(const Buffer& from, const Buffer& to, uint64_t size) {
    if (size == 0) return;
    barrier();
    const VkBufferCopy region{0, 0, size};
    vk_.vkCmdCopyBuffer(recording_.commands(), from.handle(), to.handle(), 1, &region);
}

void Recorder::fill(const Buffer& buffer, uint32_t value) {
    barrier();
    vk_.vkCmdFillBuffer(recording_.commands(), buffer.handle(), 0, VK_WHOLE_SIZE, value);
}

void record_barrier(const VolkDeviceTable& vk, VkCommandBuffer commands) {
    VkMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
    barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                            VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_TRANSFER_WRITE_BIT |
                            VK_ACCESS_INDIRECT_COMMAND_READ_BIT;
    constexpr VkPipelineStageFlags kWork = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT |
                                           VK_PIPELINE_STAGE_TRANSFER_BIT |
                                           VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT;
    vk.vkCmdPipelineBarrier(commands, kWork, kWork, 0, 1, &barrier, 0, nullptr, 0, nullptr);
}

}  // namespace defrec::vulkan
