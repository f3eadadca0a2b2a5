// Loads of 16 bytes at a time.
#pragma once
#include <type_traits>

#include "backends/cuda/device/device_code.hpp"

namespace defrec::cuda {
namespace {

// from: aligned to 16 bytes.
template <class T, int kCount>
__device__ __forceinline__ void load_fours(const T* from, T (&to)[kCount]) {
    static_assert(std::is_same_v<T, float> || std::is_same_v<T, int>);
    using Four = std::conditional_t<std::is_same_v<T, float>, float4, int4>;
#pragma unroll
    for (int i = 0; i < kCount; i += 4) {
        const Four four = *reinterpret_cast<const Four*>(from + i);
        to[i] = four.x;
        to[i + 1] = four.y;
        to[i + 2] = four.z;
        to[i + 3] = four.w;
    }
}

}  // namespace
}  // namespace defrec::cuda
