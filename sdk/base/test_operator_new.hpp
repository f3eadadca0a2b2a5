// Replaces operator new and delete of the process that it is part of: counts the blocks, and lets
// allocations fail. For one source file of a test's program or library, which defines
// allocation_fails.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace defrec::test {

// Asked for each allocation; caller: where in the code operator new was called.
bool allocation_fails(void* caller);

inline std::atomic<long> live{0}, taken{0};  // blocks there are, and were ever

inline void* take(std::size_t size, std::size_t alignment, void* caller) noexcept {
    if (allocation_fails(caller)) return nullptr;
    ++taken;
    void* memory =
        alignment <= alignof(std::max_align_t)
            ? std::malloc(size == 0 ? 1 : size)
            : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
    if (memory != nullptr) ++live;
    return memory;
}
inline void* take_or_throw(std::size_t size, std::size_t alignment, void* caller) {
    void* memory = take(size, alignment, caller);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}
inline void give(void* memory) noexcept {
    if (memory == nullptr) return;
    --live;
    std::free(memory);
}

}  // namespace defrec::test

// NOLINTBEGIN(misc-definitions-in-headers): replacements may not be inline.
void* operator new(std::size_t size) {
    return defrec::test::take_or_throw(size, 1, __builtin_return_address(0));
}
void* operator new[](std::size_t size) {
    return defrec::test::take_or_throw(size, 1, __builtin_return_address(0));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
    return defrec::test::take_or_throw(size, std::size_t(alignment), __builtin_return_address(0));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
    return defrec::test::take_or_throw(size, std::size_t(alignment), __builtin_return_address(0));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    return defrec::test::take(size, 1, __builtin_return_address(0));
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
    return defrec::test::take(size, 1, __builtin_return_address(0));
}
void operator delete(void* memory) noexcept { defrec::test::give(memory); }
void operator delete[](void* memory) noexcept { defrec::test::give(memory); }
void operator delete(void* memory, std::size_t) noexcept { defrec::test::give(memory); }
void operator delete[](void* memory, std::size_t) noexcept { defrec::test::give(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { defrec::test::give(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { defrec::test::give(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
    defrec::test::give(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
    defrec::test::give(memory);
}
// NOLINTEND(misc-definitions-in-headers)
