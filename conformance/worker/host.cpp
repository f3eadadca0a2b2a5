// See host.hpp.
#include "conformance/worker/host.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "sdk/base/os/aligned_memory.hpp"
#include "sdk/base/util/error.hpp"

namespace defrec::conformance {
namespace {

constexpr size_t kGuard = 64;  // bytes before and behind each block
constexpr size_t kMaxMemory =
    size_t{1} << 40;  // an allocator with checks of its own ends the process instead of saying no
constexpr unsigned char kGuardByte = 0xA7;
constexpr unsigned char kFreshByte = 0x5B;  // fresh memory is not zero: nobody is to rely on that
constexpr unsigned char kFreedByte = 0xE3;

bool intact(const unsigned char* guard, size_t size) {
    return std::all_of(guard, guard + size, [](unsigned char byte) { return byte == kGuardByte; });
}

}  // namespace

Host::Host(uint32_t threads) : pool_(threads) {
    table_.struct_size = sizeof table_;
    table_.abi_minor = DEFREC_PLUGIN_ABI_MINOR;
    table_.self = this;
    table_.log = [](void* self, int32_t, const char* text) {
        const std::lock_guard lock(of(self).mutex_);
        of(self).log_ = text == nullptr ? "" : text;
    };
    table_.error = [](void* self, const char* text) {
        const std::lock_guard lock(of(self).mutex_);
        of(self).errors_[std::this_thread::get_id()] = text == nullptr ? "" : text;
    };
    table_.alloc = [](void* self, size_t size, size_t alignment) {
        return of(self).allocate(size, alignment);
    };
    table_.free = [](void* self, void* memory) { of(self).release(memory); };
    table_.parallel_for = [](void* self, size_t count, void (*body)(void*, size_t), void* arg) {
        of(self).pool_.parallel_for(count, body, arg);
    };
    table_.concurrency = [](void* self) { return of(self).pool_.threads(); };
}

std::string Host::take_error() {
    const std::lock_guard lock(mutex_);
    return std::exchange(errors_[std::this_thread::get_id()], {});
}

std::string Host::last_log() const {
    const std::lock_guard lock(mutex_);
    return log_;
}

std::string Host::misuse() {
    const std::lock_guard lock(mutex_);
    for (const auto& [memory, block] : blocks_) check_guards(memory, block);
    return misuse_;
}

void Host::note_misuse(const std::string& text) {
    if (misuse_.empty()) misuse_ = text;
}

void Host::check_guards(const void* memory, const Block& block) {
    const auto* bytes = static_cast<const unsigned char*>(memory);
    if (!intact(bytes - kGuard, kGuard))
        note_misuse(
            concat("bytes before a block of ", block.size, " bytes of host memory were written"));
    if (!intact(bytes + block.size, kGuard))
        note_misuse(
            concat("bytes behind a block of ", block.size, " bytes of host memory were written"));
}

void Host::fail_allocation(uint64_t nth, bool all_later) {
    fail_later_ = all_later;
    fail_at_ = nth == 0 ? 0 : allocations_ + nth;
}

void* Host::allocate(size_t size, size_t alignment) {
    const uint64_t number = ++allocations_, fail_at = fail_at_;
    if (fail_at != 0 && (number == fail_at || (fail_later_ && number > fail_at))) return nullptr;
    if (!std::has_single_bit(alignment)) {
        const std::lock_guard lock(mutex_);
        note_misuse(concat("alloc was asked for an alignment of ", alignment,
                           ", a power of two is expected"));
        return nullptr;
    }
    const size_t before = std::max(kGuard, alignment);
    if (size > kMaxMemory) return nullptr;
    void* start = allocate_aligned(before + size + kGuard, before);
    if (start == nullptr) return nullptr;
    auto* memory = static_cast<unsigned char*>(start) + before;
    std::memset(memory - kGuard, kGuardByte, kGuard);
    std::memset(memory, kFreshByte, size);
    std::memset(memory + size, kGuardByte, kGuard);
    ++live_blocks_;
    live_bytes_ += size;
    const std::lock_guard lock(mutex_);
    blocks_[memory] = {size, start};
    return memory;
}

void Host::release(void* memory) {
    if (memory == nullptr) return;
    Block block{};
    {
        const std::lock_guard lock(mutex_);
        const auto found = blocks_.find(memory);
        if (found == blocks_.end())
            return note_misuse(
                "free was called with memory that alloc did not give, or twice with the same");
        block = found->second;
        blocks_.erase(found);
        check_guards(memory, block);
    }
    std::memset(memory, kFreedByte, block.size);
    --live_blocks_;
    live_bytes_ -= block.size;
    free_aligned(block.start);
}

}  // namespace defrec::conformance
