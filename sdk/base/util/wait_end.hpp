// When a wait ends that a caller limits in nanoseconds, UINT64_MAX being for ever.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>

namespace defrec {

inline std::chrono::steady_clock::time_point wait_end(uint64_t timeout_ns) {
    // Beyond a century the clock's arithmetic would overflow; nobody waits for a part of that.
    constexpr uint64_t kForEver = uint64_t{100} * 365 * 24 * 3600 * 1000000000u;
    return std::chrono::steady_clock::now() +
           std::chrono::nanoseconds(std::min(timeout_ns, kForEver));
}

}  // namespace defrec
