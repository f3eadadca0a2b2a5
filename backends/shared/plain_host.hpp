// A host whose allocator is the C library's, for what reads templates through a host where none
// gave one.
#pragma once

#include "backends/shared/stage.hpp"
#include "sdk/base/os/aligned_memory.hpp"

namespace defrec {

inline const defrec_host& plain_host() {
    static const defrec_host host = [] {
        defrec_host table{};
        table.struct_size = sizeof table;
        table.alloc = [](void*, size_t size, size_t alignment) -> void* {
            return allocate_aligned(size, alignment);
        };
        table.free = [](void*, void* memory) { free_aligned(memory); };
        return table;
    }();
    return host;
}

}  // namespace defrec
