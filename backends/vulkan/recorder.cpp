// See recorder.hpp.
#include "backends/vulkan/recorder.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <string>
#include <utility>

#include "backends/vulkan/check.hpp"

namespace defrec::vulkan {

constexpr uint32_t kSetsPerPool = 32, kBuffersPerPool = 256;

namespace {

// Where nothing but shaders is on either side.
void record_shader_barrier(const VolkDeviceTable& vk, VkCommandBuffer commands) {
    VkMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
    barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT;
    constexpr VkPipelineStageFlags kShader = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
    vk.vkCmdPipelineBarrier(commands, kShader, kShader, 0, 1, &barrier, 0, nullptr, 0, nullptr);
}

}  // namespace

CommandBuffer::CommandBuffer(const Device& device) : device_(device) {
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

CommandBuffer::~CommandBuffer() {
    device_.vk().vkDestroyCommandPool(device_.handle(), pool_, nullptr);
}

void CommandBuffer::begin() {
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_SIMULTANEOUS_USE_BIT;  // a frame may be queued before the
                                                                 // last one is done
    check(device_.vk().vkBeginCommandBuffer(commands_, &begin), "vkBeginCommandBuffer");
}

void CommandBuffer::end() {
    check(device_.vk().vkEndCommandBuffer(commands_), "vkEndCommandBuffer");
}

Recording::~Recording() {
    device_.forget(*this);
    for (VkDescriptorPool pool : descriptor_pools_)
        device_.vk().vkDestroyDescriptorPool(device_.handle(), pool, nullptr);
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

void Recording::put(VkCommandBuffer commands, const Operation& operation) const {
    const VolkDeviceTable& vk = device_.vk();
    if (operation.kernel == nullptr) {
        const VkBufferCopy region{0, 0, operation.size};
        if (operation.source != VK_NULL_HANDLE)
            vk.vkCmdCopyBuffer(commands, operation.source, operation.target, 1, &region);
        else
            vk.vkCmdFillBuffer(commands, operation.target, 0, operation.size, operation.value);
        return;
    }
    const VkPipelineLayout layout = operation.kernel->layout();
    vk.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, operation.kernel->pipeline());
    vk.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout, 0, 1,
                               &operation.set, 0, nullptr);
    vk.vkCmdPushConstants(commands, layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, operation.push_size,
                          operation.push.data());
    if (operation.source != VK_NULL_HANDLE)
        vk.vkCmdDispatchIndirect(commands, operation.source, 0);
    else
        vk.vkCmdDispatch(commands, operation.groups.x, operation.groups.y, operation.groups.z);
}

// Operations in rounds: each in the first after those of all before it that it depends on.
class Recording::Schedule {
  public:
    // Behind all that was added before.
    void add(const Recording& recording) {
        for (const Operation& operation : recording.operations_) {
            if (!operation.beside) note_placed();
            const size_t round = first_round(operation);
            if (rounds_.size() == round) rounds_.emplace_back();
            rounds_[round].emplace_back(&recording, &operation);
            placed_.emplace_back(&operation, round);
        }
        note_placed();
    }
    size_t rounds() const { return rounds_.size(); }

    void write(const VolkDeviceTable& vk, CommandBuffer& commands) const {
        commands.begin();
        bool copied = true;  // whatever was before
        for (Round round : rounds_) {
            // The smallest first: behind one that fills the device it would begin when that ends.
            // An indirect one counts as one group: orb's has a small one for each feature.
            std::stable_sort(round.begin(), round.end(), [](const auto& one, const auto& other) {
                return one.second->groups.count() < other.second->groups.count();
            });
            const bool copies = std::any_of(round.begin(), round.end(), [](const auto& placed) {
                return placed.second->kernel == nullptr || placed.second->source != VK_NULL_HANDLE;
            });
            if (copied || copies)
                record_barrier(vk, commands.handle());
            else
                record_shader_barrier(vk, commands.handle());
            copied = copies;
            for (const auto& [recording, operation] : round)
                recording->put(commands.handle(), *operation);
        }
        commands.end();
    }

  private:
    // Between two barriers.
    using Round = std::vector<std::pair<const Recording*, const Operation*>>;
    // The round after the last that reads a buffer, and that writes it.
    struct Use {
        size_t read = 0, written = 0;
    };

    size_t first_round(const Operation& operation) {
        size_t round = 0;
        for (const uint64_t buffer : operation.reads)
            round = std::max(round, uses_[buffer].written);
        for (const uint64_t buffer : operation.writes)
            round = std::max({round, uses_[buffer].written, uses_[buffer].read});
        return round;
    }
    // What comes next depends on them.
    void note_placed() {
        for (const auto& [operation, round] : placed_) {
            for (const uint64_t buffer : operation->reads)
                uses_[buffer].read = std::max(uses_[buffer].read, round + 1);
            for (const uint64_t buffer : operation->writes)
                uses_[buffer].written = std::max(uses_[buffer].written, round + 1);
        }
        placed_.clear();
    }

    std::vector<Round> rounds_;
    std::map<uint64_t, Use> uses_;                             // by serial
    std::vector<std::pair<const Operation*, size_t>> placed_;  // beside each other, and where
};

JointRecording::JointRecording(const Device& device, std::span<const Recording* const> parts)
    : parts_(parts.begin(), parts.end()), commands_(device) {
    Recording::Schedule schedule;
    for (const Recording* part : parts_) schedule.add(*part);
    schedule.write(device.vk(), commands_);
    rounds_ = schedule.rounds();
}

void Recorder::finish() {
    Recording::Schedule schedule;
    schedule.add(recording_);
    schedule.write(recording_.device_.vk(), recording_.commands_);
    recording_.rounds_ = schedule.rounds();
}

Recording::Operation& Recorder::add(const std::shared_ptr<const Kernel>& kernel,
                                    std::initializer_list<Binding> bindings, const void* push,
                                    uint32_t push_size) {
    const size_t expected =
        kernel->bindings() - (recording_.device_.instrument() != nullptr ? 1 : 0);
    if (bindings.size() != expected)
        throw StageError(DEFREC_ERROR_INTERNAL, std::string("shader ") + kernel->name() + " has " +
                                                    std::to_string(expected) + " buffers, " +
                                                    std::to_string(bindings.size()) + " given");
    Recording::Operation operation;
    uint32_t index = 0;
    for (const Binding& binding : bindings) {
        const bool written = kernel->writes(index++);
        if (binding.buffer != nullptr)
            (written ? operation.writes : operation.reads).push_back(binding.buffer->serial());
    }
    if (const Instrument* instrument = recording_.device_.instrument(); instrument != nullptr)
        operation.writes.push_back(instrument->results.serial());
    operation.kernel = kernel;
    operation.set = recording_.descriptor_set(*kernel, bindings);
    std::memcpy(operation.push.data(), push, push_size);
    operation.push_size = push_size;
    return recording_.operations_.emplace_back(std::move(operation));
}

void Recorder::copy(const Buffer& from, const Buffer& to, uint64_t size) {
    if (size == 0) return;
    Recording::Operation operation;
    operation.source = from.handle();
    operation.target = to.handle();
    operation.size = size;
    operation.reads = {from.serial()};
    operation.writes = {to.serial()};
    recording_.operations_.push_back(std::move(operation));
}

void Recorder::fill(const Buffer& buffer, uint32_t value) {
    Recording::Operation operation;
    operation.target = buffer.handle();
    operation.value = value;
    operation.writes = {buffer.serial()};
    recording_.operations_.push_back(std::move(operation));
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
