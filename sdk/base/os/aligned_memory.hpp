// Memory at a multiple of an alignment: Windows has no aligned_alloc.
#pragma once
#include <cstddef>
#include <cstdlib>
#ifdef _WIN32
#include <malloc.h>
#endif

namespace defrec {

// alignment: a power of two, no less than a pointer's size. size: above 0, and no more than
// SIZE_MAX less the alignment. nullptr where there is no memory.
inline void* allocate_aligned(std::size_t size, std::size_t alignment) noexcept {
#ifdef _WIN32
    return ::_aligned_malloc(size, alignment);
#else
    return std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
#endif
}

inline void free_aligned(void* memory) noexcept {
#ifdef _WIN32
    ::_aligned_free(memory);
#else
    std::free(memory);
#endif
}

}  // namespace defrec
