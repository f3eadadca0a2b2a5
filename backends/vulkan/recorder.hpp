// Records the work of a stage into a command buffer, once for each set of buffers it is run with.
#pragma once
#include <volk.h>

#include <cstring>
#include <initializer_list>
#include <memory>
#include <type_traits>
#include <vector>

#include "backends/vulkan/device.hpp"

namespace defrec::vulkan {

// Work groups in x, y, z.
struct Groups {
    uint32_t x = 1, y = 1, z = 1;
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

// Owns the command buffer and what it refers to, kernels included; buffers belong to others and
// must stay.
class Recording {
  public:
    explicit Recording(Device& device);
    ~Recording();
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

    VkCommandBuffer commands() const { return commands_; }

  private:
    friend class Recorder;
    VkDescriptorSet descriptor_set(const Kernel& kernel, std::initializer_list<Binding> bindings);
    void add_descriptor_pool();

    Device& device_;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    std::vector<VkDescriptorPool> descriptor_pools_;
    std::vector<std::shared_ptr<const Kernel>> kernels_;
};

// Every operation waits for all before it, those of earlier command buffers included, and sees what
// they wrote; but one recorded with `beside` runs along with the operation just before it: neither
// may read or write what the other writes.
class Recorder {
  public:
    explicit Recorder(Recording& recording);
    // Ends the command buffer.
    void finish();

    // push: the shader's push constants, a struct of 4-byte (8-byte aligned) scalars, at most
    // kPushBytes.
    template <class Push>
    void dispatch(const std::shared_ptr<const Kernel>& kernel,
                  std::initializer_list<Binding> bindings, const Push& push, Groups groups) {
        barrier();
        beside(kernel, bindings, push, groups);
    }
    template <class Push>
    void beside(const std::shared_ptr<const Kernel>& kernel,
                std::initializer_list<Binding> bindings, const Push& push, Groups groups) {
        bind(kernel, bindings, &push, push_size<Push>());
        vk_.vkCmdDispatch(recording_.commands(), groups.x, groups.y, groups.z);
    }
    // The numbers of groups are the first three uint32 in `counts`, which earlier work may have
    // written.
    template <class Push>
    void dispatch_indirect(const std::shared_ptr<const Kernel>& kernel,
                           std::initializer_list<Binding> bindings, const Push& push,
                           const Buffer& counts) {
        barrier();
        bind(kernel, bindings, &push, push_size<Push>());
        vk_.vkCmdDispatchIndirect(recording_.commands(), counts.handle(), 0);
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
    void bind(const std::shared_ptr<const Kernel>& kernel, std::initializer_list<Binding> bindings,
              const void* push, uint32_t push_size);
    void barrier();

    Recording& recording_;
    const VolkDeviceTable& vk_;
};

// All earlier work of the queue done, and its writes seen by what follows.
void record_barrier(const VolkDeviceTable& vk, VkCommandBuffer commands);

}  // namespace defrec::vulkan
