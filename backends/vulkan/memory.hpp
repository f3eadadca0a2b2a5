// Device memory in blocks: a driver allows only some thousand allocations, and a few dozen trackers
// need more buffers than that.
#pragma once
#include <volk.h>

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

namespace defrec::vulkan {

enum class MemoryUse {
    device,    // shaders read and write it
    upload,    // the host writes, the device copies from it
    download,  // the device copies to it, the host reads
    host,      // both ways; begins at a multiple of 64 bytes
};

// A range of a block. mapped: where the host sees it, nullptr for MemoryUse::device.
struct MemoryRange {
    VkDeviceMemory memory = VK_NULL_HANDLE;
    VkDeviceSize offset = 0, size = 0;
    std::byte* mapped = nullptr;
    void* block = nullptr;  // the pool's own
};

// threads: any.
class MemoryPool {
  public:
    MemoryPool(VkPhysicalDevice physical, VkDevice device, const VolkDeviceTable& vk);
    ~MemoryPool();
    MemoryPool(const MemoryPool&) = delete;
    MemoryPool& operator=(const MemoryPool&) = delete;

    // Throws StageError(DEFREC_ERROR_OUT_OF_MEMORY).
    MemoryRange allocate(const VkMemoryRequirements& requirements, MemoryUse use);
    void release(const MemoryRange& range) noexcept;

  private:
    struct Gap {
        VkDeviceSize offset, size;
    };
    struct Block {
        VkDeviceMemory memory;
        uint32_t type;
        VkDeviceSize size;
        std::byte* mapped;
        std::vector<Gap> gaps;  // ascending, never adjacent; with room for what release adds
        size_t ranges = 0;      // taken
    };
    uint32_t memory_type(uint32_t allowed, MemoryUse use) const;
    Block& add_block(uint32_t type, VkDeviceSize size, bool map);
    bool take(Block& block, VkDeviceSize size, VkDeviceSize alignment, MemoryRange& range);

    VkDevice device_;
    const VolkDeviceTable& vk_;
    VkPhysicalDeviceMemoryProperties properties_;
    std::mutex mutex_;
    std::list<Block> blocks_;
};

}  // namespace defrec::vulkan
