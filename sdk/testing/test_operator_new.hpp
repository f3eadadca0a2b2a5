// Replaces operator new and delete of the process that it is part of: counts the blocks of
// libdefrec and its plugins, and lets their allocations fail. What others ask for (the test,
// drivers, interpreters) neither counts nor fails. For one source file of a test's program or
// library, which defines allocation_fails.
#pragma once
#include <dlfcn.h>
#include <link.h>
#include <unwind.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>

namespace defrec::test {

// Asked for each allocation of the library.
bool allocation_fails();

inline std::atomic<long> live{0}, taken{0};  // blocks there are, and were ever

// The file that code at this address was loaded from; "" for the program. Takes no memory.
inline const char* file_of(void* address) {
    dl_find_object found{};
    return _dl_find_object(address, &found) == 0 ? found.dlfo_link_map->l_name : "";
}
inline bool is_of_standard_library(void* address) {
    return std::strstr(file_of(address), "libstdc++") != nullptr;
}

// What the standard library takes, it takes for whoever called it.
inline void* user_of_standard_library(void* caller) {
    struct Walk {
        void* address;
        bool is_begun;
    } walk{caller, false};
    _Unwind_Backtrace(
        [](_Unwind_Context* frame, void* state) {
            auto& at = *static_cast<Walk*>(state);
            // NOLINTNEXTLINE(performance-no-int-to-ptr): an address of code is a number here.
            auto* const address = reinterpret_cast<void*>(_Unwind_GetIP(frame));
            at.is_begun = at.is_begun || address == at.address;
            if (!at.is_begun) return _URC_NO_REASON;
            at.address = address;
            return is_of_standard_library(address) ? _URC_NO_REASON : _URC_END_OF_STACK;
        },
        &walk);
    return walk.address;
}

// Whether what is called from there is for libdefrec, a plugin, which is loaded through a
// descriptor, or the reader of manifests.
inline bool is_of_library(void* caller) {
    if (is_of_standard_library(caller)) caller = user_of_standard_library(caller);
    const char* file = file_of(caller);
    for (const char* part : {"libdefrec.so", "defrec_plugin_", "/proc/self/fd/", "libyaml-cpp"})
        if (std::strstr(file, part) != nullptr) return true;
    return false;
}

// Before each block, as far as its alignment asks for; its last byte: whether it is the library's.
inline std::size_t size_of_head(std::size_t alignment) {
    return std::max(alignment, alignof(std::max_align_t));
}

inline void* take(std::size_t size, std::size_t alignment, void* caller) noexcept {
    const bool is_counted = is_of_library(caller);
    if (is_counted && allocation_fails()) return nullptr;
    const std::size_t head = size_of_head(alignment);
    if (size > SIZE_MAX - 2 * head) return nullptr;
    auto* const block =
        static_cast<char*>(alignment <= alignof(std::max_align_t)
                               ? std::malloc(head + size)
                               : std::aligned_alloc(head, (head + size + head - 1) / head * head));
    if (block == nullptr) return nullptr;
    if (is_counted) {
        ++taken;
        ++live;
    }
    block[head - 1] = is_counted ? 1 : 0;
    return block + head;
}
inline void* take_or_throw(std::size_t size, std::size_t alignment, void* caller) {
    void* memory = take(size, alignment, caller);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}
// Inlined, gcc would take the byte before the block for one out of its bounds.
[[gnu::noinline]] inline void give(void* memory, std::size_t alignment = 1) noexcept {
    if (memory == nullptr) return;
    auto* const bytes = static_cast<char*>(memory);
    if (bytes[-1] != 0) --live;
    std::free(bytes - size_of_head(alignment));
}

}  // namespace defrec::test

// Replacements may not be inline.
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
void operator delete(void* memory, std::align_val_t alignment) noexcept {
    defrec::test::give(memory, std::size_t(alignment));
}
void operator delete[](void* memory, std::align_val_t alignment) noexcept {
    defrec::test::give(memory, std::size_t(alignment));
}
void operator delete(void* memory, std::size_t, std::align_val_t alignment) noexcept {
    defrec::test::give(memory, std::size_t(alignment));
}
void operator delete[](void* memory, std::size_t, std::align_val_t alignment) noexcept {
    defrec::test::give(memory, std::size_t(alignment));
}
