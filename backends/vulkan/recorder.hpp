// Records the work of a stage into a command buffer, once for each set of buffers it is run with,
// and that of stages which run one after the other into one. Between barriers lie rounds of
// operations: an operation is in the first round after all that it depends on.
#pragma once
#include <volk.h>

#include <array>
#include <atomic>
#include <deque>
#include <initializer_list>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "backends/vulkan/device.hpp"

namespace defrec::vulkan {

// Work groups in x, y, z.
struct Groups {
    uint32_t x = 1, y = 1, z = 1;
    uint64_t count() const { return uint64_t{x} * y * z; }
};
// As many groups of `side` as cover `count`.
constexpr uint32_t cover(uint64_t count, uint32_t side) {
    return static_cast<uint32_t>((count + side - 1) / side);
}

// A buffer as a shader sees it; nullptr: the device's buffer that stands for none.
struct Binding {
    // NOLINTBEGIN(google-explicit-constructor): a list of buffers becomes a list of bindings
    Binding(const Buffer* given) : buffer(given) {}
    Binding(const Buffer& given) : buffer(&given) {}
    // NOLINTEND(google-explicit-constructor)
    const Buffer* buffer;
};

class CommandBuffer {
  public:
    explicit CommandBuffer(const Device& device);
    ~CommandBuffer();
    CommandBuffer(const CommandBuffer&) = delete;
    CommandBuffer& operator=(const CommandBuffer&) = delete;

    VkCommandBuffer handle() const { return commands_; }
    void begin();
    void end();

  private:
    const Device& device_;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
};

// Owns the command buffer and what it refers to, kernels included; buffers belong to others and
// must stay.
class Recording {
  public:
    explicit Recording(Device& device) : device_(device), commands_(device) {}
    ~Recording();
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

    VkCommandBuffer commands() const { return commands_.handle(); }
    size_t rounds() const { return rounds_; }
    // Whether it was asked before: what runs once is not worth a joint recording.
    bool ran_before() const { return ran_.exchange(true); }

  private:
    friend class Recorder;
    friend class JointRecording;
    // A dispatch, where there is a kernel (indirect, where there is a source: of the groups); a
    // copy, where there is a source; else a fill.
    struct Operation {
        bool beside = false;  // does not depend on the operation before it
        std::shared_ptr<const Kernel> kernel;
        VkDescriptorSet set = VK_NULL_HANDLE;
        std::array<std::byte, kPushBytes> push{};
        uint32_t push_size = 0;
        Groups groups;
        VkBuffer source = VK_NULL_HANDLE, target = VK_NULL_HANDLE;
        VkDeviceSize size = VK_WHOLE_SIZE;
        uint32_t value = 0;
        std::vector<uint64_t> reads, writes;  // serials of buffers
    };
    class Schedule;
    VkDescriptorSet descriptor_set(const Kernel& kernel, std::initializer_list<Binding> bindings);
    void add_descriptor_pool();
    void put(VkCommandBuffer commands, const Operation& operation) const;

    Device& device_;
    CommandBuffer commands_;
    std::vector<VkDescriptorPool> descriptor_pools_;
    std::vector<Operation> operations_;
    std::deque<Buffer> scratch_;
    size_t rounds_ = 0;
    mutable std::atomic<bool> ran_{false};
};

// Several recordings in one command buffer, and in its rounds.
class JointRecording {
  public:
    JointRecording(const Device& device, std::span<const Recording* const> parts);

    VkCommandBuffer commands() const { return commands_.handle(); }
    std::span<const Recording* const> parts() const { return parts_; }
    size_t rounds() const { return rounds_; }

  private:
    std::vector<const Recording*> parts_;
    size_t rounds_ = 0;
    CommandBuffer commands_;
};

// An operation sees what all before it wrote, those of earlier command buffers included. It depends
// on those before it that write what it reads or writes, or read what it writes; but one recorded
// with `beside` not on the operation just before it, nor on those that this one is beside: none may
// read or write the part of a buffer that another writes.
class Recorder {
  public:
    explicit Recorder(Recording& recording) : recording_(recording) {}
    // Writes the command buffer.
    void finish();

    // push: the shader's push constants, a struct of 4-byte (8-byte aligned) scalars, at most
    // kPushBytes.
    template <class Push>
    void dispatch(const std::shared_ptr<const Kernel>& kernel,
                  std::initializer_list<Binding> bindings, const Push& push, Groups groups) {
        add(kernel, bindings, &push, push_size<Push>()).groups = groups;
    }
    template <class Push>
    void beside(const std::shared_ptr<const Kernel>& kernel,
                std::initializer_list<Binding> bindings, const Push& push, Groups groups) {
        Recording::Operation& operation = add(kernel, bindings, &push, push_size<Push>());
        operation.groups = groups;
        operation.beside = true;
    }
    // The numbers of groups are the first three uint32 in `counts`, which earlier work may have
    // written.
    template <class Push>
    void dispatch_indirect(const std::shared_ptr<const Kernel>& kernel,
                           std::initializer_list<Binding> bindings, const Push& push,
                           const Buffer& counts) {
        Recording::Operation& operation = add(kernel, bindings, &push, push_size<Push>());
        operation.source = counts.handle();
        operation.reads.push_back(counts.serial());
    }

    // Memory of this recording alone: with it a stage's recordings for other buffers need not
    // wait for this one.
    const Buffer& scratch(uint64_t size) {
        return recording_.scratch_.emplace_back(recording_.device_, size);
    }
    // From the beginning of both.
    void copy(const Buffer& from, const Buffer& to, uint64_t size);
    void fill(const Buffer& buffer, uint32_t value);

  private:
    template <class Push>
    static constexpr uint32_t push_size() {
        static_assert(std::is_trivially_copyable_v<Push> && sizeof(Push) <= kPushBytes &&
                      sizeof(Push) % 4 == 0);
        return sizeof(Push);
    }
    Recording::Operation& add(const std::shared_ptr<const Kernel>& kernel,
                              std::initializer_list<Binding> bindings, const void* push,
                              uint32_t push_size);

    Recording& recording_;
};

// All earlier work of the queue done, and its writes seen by what follows.
void record_barrier(const VolkDeviceTable& vk, VkCommandBuffer commands);

}  // namespace defrec::vulkan
