// The sum at the end of the library's own files: FNV-1a, but for the basis.
#pragma once
#include "sdk/base/util/fnv1a.hpp"

namespace defrec {

inline uint64_t file_checksum(const void* data, size_t size) {
    constexpr uint64_t kBasis = 1469598103934665603;
    return fnv1a(kBasis, data, size);
}

}  // namespace defrec
