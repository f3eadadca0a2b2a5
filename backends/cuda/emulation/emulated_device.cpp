// See emulated_device.hpp.
#include "backends/cuda/emulation/emulated_device.hpp"

#include <cstring>
#include <new>

#include "backends/cuda/emulation/block.hpp"

namespace defrec::cuda {

constexpr std::align_val_t kAlignment{256};
constexpr int kNeverWritten = 0xa5;  // fresh memory must not look like zeros

std::byte* EmulatedDevice::allocate(uint64_t size) {
    auto* memory = static_cast<std::byte*>(::operator new(size, kAlignment));
    std::memset(memory, kNeverWritten, size);
    return memory;
}
void EmulatedDevice::release(std::byte* memory) noexcept { ::operator delete(memory, kAlignment); }
void EmulatedDevice::copy_to_device(std::byte* to, const void* from, uint64_t size) {
    if (size != 0) std::memcpy(to, from, size);
}
void EmulatedDevice::clear(std::byte* memory, uint64_t size) { std::memset(memory, 0, size); }
uint32_t EmulatedDevice::resident_blocks(const void*, uint32_t, size_t shared) const {
    const size_t for_each = std::max<size_t>(shared, 16 * 1024);
    return limits_.multiprocessors *
           static_cast<uint32_t>(limits_.shared_per_multiprocessor / for_each);
}

bool EmulatedDevice::holds_cluster(const void* function, uint32_t blocks, uint32_t threads,
                                   size_t shared) const {
    return limits_.compute_capability >= 90 &&
           blocks <= std::min(16u, resident_blocks(function, threads, shared));
}

void run(const Recording& recording) {
    for (const Node& node : recording.nodes) {
        if (const auto* call = std::get_if<KernelCall>(&node.work)) emulation::run(*call);
        if (const auto* fill = std::get_if<Fill>(&node.work))
            std::memset(fill->memory, fill->value, fill->size);
        if (const auto* copy = std::get_if<Copy>(&node.work))
            std::memcpy(copy->to, copy->from, copy->size);
    }
}

}  // namespace defrec::cuda
