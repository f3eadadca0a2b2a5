// See memory.hpp.
#include "backends/vulkan/memory.hpp"

#include <algorithm>

#include "backends/vulkan/check.hpp"

namespace defrec::vulkan {
namespace {

constexpr VkDeviceSize kBlock = VkDeviceSize{16} << 20;
constexpr VkDeviceSize kHostAlignment = 64;  // every device maps blocks at a multiple of it
constexpr size_t kFirstGaps = 8;
constexpr VkDeviceSize kOwnBlock = kBlock / 4;  // larger requests get a block to themselves

VkDeviceSize round_up(VkDeviceSize value, VkDeviceSize multiple) {
    return (value + multiple - 1) / multiple * multiple;
}

}  // namespace

MemoryPool::MemoryPool(VkPhysicalDevice physical, VkDevice device, const VolkDeviceTable& vk)
    : device_(device), vk_(vk) {
    vkGetPhysicalDeviceMemoryProperties(physical, &properties_);
}

MemoryPool::~MemoryPool() {
    for (const Block& block : blocks_) vk_.vkFreeMemory(device_, block.memory, nullptr);
}

uint32_t MemoryPool::memory_type(uint32_t allowed, MemoryUse use) const {
    constexpr VkMemoryPropertyFlags kHost =
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    const VkMemoryPropertyFlags needed = use == MemoryUse::device ? 0 : kHost;
    const VkMemoryPropertyFlags liked =
        use == MemoryUse::device   ? VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT
        : use == MemoryUse::upload ? 0
                                   : VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
    for (const VkMemoryPropertyFlags wanted : {needed | liked, needed})
        for (uint32_t i = 0; i < properties_.memoryTypeCount; ++i)
            if ((allowed >> i & 1) != 0 &&
                (properties_.memoryTypes[i].propertyFlags & wanted) == wanted)
                return i;
    throw StageError(DEFREC_ERROR_UNSUPPORTED, "the device has no memory that the host can write");
}

MemoryPool::Block& MemoryPool::add_block(uint32_t type, VkDeviceSize size, bool map) {
    VkMemoryAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    info.allocationSize = size;
    info.memoryTypeIndex = type;
    std::list<Block> added;
    Block& block = added.emplace_back(Block{VK_NULL_HANDLE, type, size, nullptr, {{0, size}}});
    block.gaps.reserve(kFirstGaps);
    check(vk_.vkAllocateMemory(device_, &info, nullptr, &block.memory), "vkAllocateMemory");
    if (map) {
        void* mapped = nullptr;
        const VkResult result =
            vk_.vkMapMemory(device_, block.memory, 0, VK_WHOLE_SIZE, 0, &mapped);
        if (result != VK_SUCCESS) vk_.vkFreeMemory(device_, block.memory, nullptr);
        check(result, "vkMapMemory");
        block.mapped = static_cast<std::byte*>(mapped);
    }
    blocks_.splice(blocks_.end(), added);
    return block;
}

bool MemoryPool::take(Block& block, VkDeviceSize size, VkDeviceSize alignment, MemoryRange& range) {
    for (auto gap = block.gaps.begin(); gap != block.gaps.end(); ++gap) {
        const VkDeviceSize start = round_up(gap->offset, alignment), end = gap->offset + gap->size;
        if (start + size > end) continue;
        // Each range taken may become a gap between two others.
        if (const size_t maximum = block.ranges + 3; block.gaps.capacity() < maximum) {
            const auto index = gap - block.gaps.begin();
            block.gaps.reserve(2 * maximum);
            gap = block.gaps.begin() + index;
        }
        ++block.ranges;
        const Gap before{gap->offset, start - gap->offset}, after{start + size, end - start - size};
        gap = block.gaps.erase(gap);
        if (after.size != 0) gap = block.gaps.insert(gap, after);
        if (before.size != 0) block.gaps.insert(gap, before);
        range = {block.memory, start, size,
                 block.mapped == nullptr ? nullptr : block.mapped + start, &block};
        return true;
    }
    return false;
}

MemoryRange MemoryPool::allocate(const VkMemoryRequirements& requirements, MemoryUse use) {
    const std::lock_guard lock(mutex_);
    const uint32_t type = memory_type(requirements.memoryTypeBits, use);
    const bool map = use != MemoryUse::device;
    const VkDeviceSize alignment =
        std::max(requirements.alignment, use == MemoryUse::host ? kHostAlignment : 1);
    MemoryRange range;
    if (requirements.size < kOwnBlock)
        for (Block& block : blocks_)
            if (block.type == type && (block.mapped != nullptr) == map &&
                take(block, requirements.size, alignment, range))
                return range;
    Block& block = add_block(type, requirements.size < kOwnBlock ? kBlock : requirements.size, map);
    take(block, requirements.size, alignment, range);
    return range;
}

void MemoryPool::release(const MemoryRange& range) noexcept {
    const std::lock_guard lock(mutex_);
    Block& block = *static_cast<Block*>(range.block);
    --block.ranges;
    auto& gaps = block.gaps;
    auto next = std::find_if(gaps.begin(), gaps.end(),
                             [&](const Gap& gap) { return gap.offset > range.offset; });
    next = gaps.insert(next, {range.offset, range.size});
    const auto join = [&](auto first) {
        const auto second = first + 1;
        if (second == gaps.end() || first->offset + first->size != second->offset) return;
        first->size += second->size;
        gaps.erase(second);
    };
    const auto index = next - gaps.begin();
    join(next);
    if (index > 0) join(gaps.begin() + index - 1);
    if (gaps.size() != 1 || gaps[0].size != block.size) return;
    vk_.vkFreeMemory(device_, block.memory, nullptr);
    blocks_.remove_if([&](const Block& other) { return &other == &block; });
}

}  // namespace defrec::vulkan
