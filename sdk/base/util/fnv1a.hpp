// FNV-1a (Fowler, Noll and Vo), 64 bits: tells contents apart, not against anybody who forges them.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec {

inline constexpr uint64_t kFnvBasis = 0xcbf29ce484222325;

// The hash with one byte more, or with a word of several where speed matters.
constexpr uint64_t fnv1a(uint64_t hash, uint64_t word) { return (hash ^ word) * 0x100000001b3; }

// The hash with these bytes more.
inline uint64_t fnv1a(uint64_t hash, const void* data, size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (size_t i = 0; i < size; ++i) hash = fnv1a(hash, bytes[i]);
    return hash;
}

}  // namespace defrec
