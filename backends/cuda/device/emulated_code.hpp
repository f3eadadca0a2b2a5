// What kernels use of CUDA's language, for a C++ compiler: each thread of a block is a fiber, so
// that barriers and exchanges within a warp mean what they mean on a GPU. Tests run every kernel
// this way where there is no GPU. A kernel may use what is declared here and no more.
#pragma once
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#define __global__
#define __device__
#define __host__
#define __constant__
#define __forceinline__ inline
#define __launch_bounds__(...)
#define __shared__ static thread_local  // one OS thread runs a block at a time
#define __restrict__ __restrict

struct dim3 {
    uint32_t x = 1, y = 1, z = 1;
    // NOLINTNEXTLINE(google-explicit-constructor): as CUDA's own
    constexpr dim3(uint32_t width = 1, uint32_t height = 1, uint32_t depth = 1)
        : x(width), y(height), z(depth) {}
};
using uint3 = dim3;

// ---- vectors ----------------------------------------------------------------

#define DEFREC_EMULATED_VECTOR(Type, Scalar)                                          \
    struct alignas(2 * sizeof(Scalar)) Type##2 {                                      \
        Scalar x, y;                                                                  \
    };                                                                                \
    struct Type##3 {                                                                  \
        Scalar x, y, z;                                                               \
    };                                                                                \
    struct alignas(4 * sizeof(Scalar) < 16 ? 4 * sizeof(Scalar) : 16) Type##4 {       \
        Scalar x, y, z, w;                                                            \
    };                                                                                \
    inline Type##2 make_##Type##2(Scalar x, Scalar y) { return {x, y}; }              \
    inline Type##3 make_##Type##3(Scalar x, Scalar y, Scalar z) { return {x, y, z}; } \
    inline Type##4 make_##Type##4(Scalar x, Scalar y, Scalar z, Scalar w) { return {x, y, z, w}; }
DEFREC_EMULATED_VECTOR(char, signed char)
DEFREC_EMULATED_VECTOR(uchar, unsigned char)
DEFREC_EMULATED_VECTOR(short, short)
DEFREC_EMULATED_VECTOR(ushort, unsigned short)
DEFREC_EMULATED_VECTOR(int, int)
DEFREC_EMULATED_VECTOR(float, float)
#undef DEFREC_EMULATED_VECTOR
struct alignas(8) uint2 {
    uint32_t x, y;
};
struct alignas(16) uint4 {
    uint32_t x, y, z, w;
};
inline uint2 make_uint2(uint32_t x, uint32_t y) { return {x, y}; }
inline uint4 make_uint4(uint32_t x, uint32_t y, uint32_t z, uint32_t w) { return {x, y, z, w}; }

// ---- threads ----------------------------------------------------------------

namespace defrec::cuda::emulation {

// The thread that runs now, on its fiber.
struct ThreadPlace {
    dim3 thread, block, block_size, grid_size;
};
const ThreadPlace& place();
std::byte* dynamic_shared_memory();
// Waits for all threads of the block; how many of them gave true.
int sync_block(bool predicate);
void sync_whole_grid();
// Waits for all lanes of mask; result[i] is lane i's value.
const uint64_t* exchange(uint32_t mask, uint64_t value);
uint32_t lane();

template <class T>
uint64_t to_bits(T value) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= 8);
    uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof value);
    return bits;
}
template <class T>
T from_bits(uint64_t bits) {
    T value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}
// The value of lane `from`, or the caller's own where that lies outside its segment of `width`
// lanes or did not take part.
template <class T>
T shuffle(uint32_t mask, T value, int from, int width) {
    const uint64_t* all = exchange(mask, to_bits(value));
    const int first = static_cast<int>(lane()) / width * width;
    const bool inside = from >= first && from < first + width && ((mask >> from) & 1) != 0;
    return inside ? from_bits<T>(all[from]) : value;
}

}  // namespace defrec::cuda::emulation

#define threadIdx (defrec::cuda::emulation::place().thread)
#define blockIdx (defrec::cuda::emulation::place().block)
#define blockDim (defrec::cuda::emulation::place().block_size)
#define gridDim (defrec::cuda::emulation::place().grid_size)

namespace defrec::cuda {
template <class T>
T* dynamic_shared() {
    return reinterpret_cast<T*>(emulation::dynamic_shared_memory());
}
class GridBarrier {
  public:
    static constexpr bool kSharesMemory = false;
    explicit GridBarrier(uint32_t*) {}
    void wait() { emulation::sync_whole_grid(); }
};
using ClusterBarrier = GridBarrier;
}  // namespace defrec::cuda

inline void __syncthreads() { defrec::cuda::emulation::sync_block(false); }
inline int __syncthreads_count(int predicate) {
    return defrec::cuda::emulation::sync_block(predicate != 0);
}
inline int __syncthreads_or(int predicate) {
    return defrec::cuda::emulation::sync_block(predicate != 0) != 0;
}
inline int __syncthreads_and(int predicate) {
    return defrec::cuda::emulation::sync_block(predicate == 0) == 0;
}
inline void __syncwarp(uint32_t mask = 0xffffffff) { defrec::cuda::emulation::exchange(mask, 0); }
inline void __threadfence() {}
inline void __threadfence_block() {}
inline void __threadfence_system() {}

template <class T>
T __shfl_sync(uint32_t mask, T value, int from, int width = 32) {
    const int first = static_cast<int>(defrec::cuda::emulation::lane()) / width * width;
    return defrec::cuda::emulation::shuffle(mask, value, first + (from & (width - 1)), width);
}
template <class T>
T __shfl_up_sync(uint32_t mask, T value, uint32_t by, int width = 32) {
    return defrec::cuda::emulation::shuffle(
        mask, value, static_cast<int>(defrec::cuda::emulation::lane()) - static_cast<int>(by),
        width);
}
template <class T>
T __shfl_down_sync(uint32_t mask, T value, uint32_t by, int width = 32) {
    return defrec::cuda::emulation::shuffle(
        mask, value, static_cast<int>(defrec::cuda::emulation::lane() + by), width);
}
template <class T>
T __shfl_xor_sync(uint32_t mask, T value, int with, int width = 32) {
    return defrec::cuda::emulation::shuffle(
        mask, value, static_cast<int>(defrec::cuda::emulation::lane()) ^ with, width);
}
inline uint32_t __ballot_sync(uint32_t mask, int predicate) {
    const uint64_t* all = defrec::cuda::emulation::exchange(mask, predicate != 0);
    uint32_t ballot = 0;
    for (uint32_t i = 0; i < 32; ++i)
        if (((mask >> i) & 1) != 0 && all[i] != 0) ballot |= 1u << i;
    return ballot;
}
inline int __any_sync(uint32_t mask, int predicate) { return __ballot_sync(mask, predicate) != 0; }
inline int __all_sync(uint32_t mask, int predicate) {
    return __ballot_sync(mask, predicate) == mask;
}
template <class T, class Combine>
T defrec_emulated_reduction(uint32_t mask, T value, Combine&& combine) {
    const uint64_t* all =
        defrec::cuda::emulation::exchange(mask, defrec::cuda::emulation::to_bits(value));
    const uint32_t me = defrec::cuda::emulation::lane();
    for (uint32_t i = 0; i < 32; ++i)
        if (i != me && ((mask >> i) & 1) != 0)
            value = combine(value, defrec::cuda::emulation::from_bits<T>(all[i]));
    return value;
}
inline uint32_t __reduce_min_sync(uint32_t mask, uint32_t value) {
    return defrec_emulated_reduction(mask, value,
                                     [](uint32_t a, uint32_t b) { return std::min(a, b); });
}
inline int __reduce_max_sync(uint32_t mask, int value) {
    return defrec_emulated_reduction(mask, value, [](int a, int b) { return std::max(a, b); });
}
inline uint32_t __reduce_add_sync(uint32_t mask, uint32_t value) {
    return defrec_emulated_reduction(mask, value, [](uint32_t a, uint32_t b) { return a + b; });
}

// ---- atomics: on integers ---------------------------------------------------

template <class T>
T atomicAdd(T* at, std::type_identity_t<T> value) {
    static_assert(std::is_integral_v<T>, "sums of floats by atomics depend on who is first");
    return __atomic_fetch_add(at, value, __ATOMIC_RELAXED);
}
template <class T, class Choose>
T defrec_emulated_atomic(T* at, Choose&& choose) {
    T before = __atomic_load_n(at, __ATOMIC_RELAXED);
    while (!__atomic_compare_exchange_n(at, &before, choose(before), false, __ATOMIC_RELAXED,
                                        __ATOMIC_RELAXED)) {
    }
    return before;
}
template <class T>
T atomicMax(T* at, std::type_identity_t<T> value) {
    return defrec_emulated_atomic(at, [=](T before) { return std::max(before, value); });
}
template <class T>
T atomicMin(T* at, std::type_identity_t<T> value) {
    return defrec_emulated_atomic(at, [=](T before) { return std::min(before, value); });
}
template <class T>
T atomicOr(T* at, std::type_identity_t<T> value) {
    return __atomic_fetch_or(at, value, __ATOMIC_RELAXED);
}
template <class T>
T atomicAnd(T* at, std::type_identity_t<T> value) {
    return __atomic_fetch_and(at, value, __ATOMIC_RELAXED);
}
template <class T>
T atomicExch(T* at, std::type_identity_t<T> value) {
    return __atomic_exchange_n(at, value, __ATOMIC_RELAXED);
}
template <class T>
T atomicCAS(T* at, std::type_identity_t<T> expected, std::type_identity_t<T> value) {
    __atomic_compare_exchange_n(at, &expected, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
    return expected;
}

// ---- arithmetic -------------------------------------------------------------

using std::max;
using std::min;
inline float fminf(float a, float b) { return std::fmin(a, b); }
inline float fmaxf(float a, float b) { return std::fmax(a, b); }
inline float rsqrtf(float x) { return 1 / std::sqrt(x); }
inline float __frcp_rn(float x) { return 1 / x; }
inline float __fsqrt_rn(float x) { return std::sqrt(x); }
inline void sincosf(float x, float* sine, float* cosine) {
    *sine = std::sin(x);
    *cosine = std::cos(x);
}
inline float __fmaf_rn(float a, float b, float c) { return std::fma(a, b, c); }
inline float __fadd_rn(float a, float b) { return a + b; }
inline float __fmul_rn(float a, float b) { return a * b; }
inline float __fdividef(float a, float b) { return a / b; }  // on a GPU off by up to 2 units
inline float __int_as_float(int bits) { return std::bit_cast<float>(bits); }
inline int __float_as_int(float value) { return std::bit_cast<int>(value); }
inline float __uint_as_float(uint32_t bits) { return std::bit_cast<float>(bits); }
inline uint32_t __float_as_uint(float value) { return std::bit_cast<uint32_t>(value); }
inline int __popc(uint32_t x) { return std::popcount(x); }
inline int __popcll(uint64_t x) { return std::popcount(x); }
inline int __clz(int x) { return std::countl_zero(static_cast<uint32_t>(x)); }
inline int __ffs(int x) { return x == 0 ? 0 : std::countr_zero(static_cast<uint32_t>(x)) + 1; }
template <class T>
T __ldg(const T* at) {
    return *at;
}
inline uint32_t __funnelshift_r(uint32_t low, uint32_t high, uint32_t by) {
    return static_cast<uint32_t>(((uint64_t{high} << 32) | low) >> (by & 31));
}
inline uint32_t __byte_perm(uint32_t x, uint32_t y, uint32_t selector) {
    const uint64_t bytes = (uint64_t{y} << 32) | x;
    uint32_t result = 0;
    for (uint32_t i = 0; i < 4; ++i)
        result |= static_cast<uint32_t>((bytes >> (8 * ((selector >> (4 * i)) & 7))) & 0xff)
                  << (8 * i);
    return result;
}
// Minimum and maximum of the two 16-bit halves, each for itself.
inline uint32_t __vminu2(uint32_t a, uint32_t b) {
    return std::min(a >> 16, b >> 16) << 16 | std::min(a & 0xffff, b & 0xffff);
}
inline uint32_t __vmaxu2(uint32_t a, uint32_t b) {
    return std::max(a >> 16, b >> 16) << 16 | std::max(a & 0xffff, b & 0xffff);
}
// c plus the products of a's and b's four bytes.
inline uint32_t __dp4a(uint32_t a, uint32_t b, uint32_t c) {
    for (int i = 0; i < 32; i += 8) c += ((a >> i) & 0xff) * ((b >> i) & 0xff);
    return c;
}
inline int __dp4a(int a, int b, int c) {
    for (int i = 0; i < 32; i += 8) c += static_cast<int8_t>(a >> i) * static_cast<int8_t>(b >> i);
    return c;
}
// c plus the products of a's two halves and two bytes of b: its lower ones, its upper ones.
inline uint32_t __dp2a_lo(uint32_t a, uint32_t b, uint32_t c) {
    return c + (a & 0xffff) * (b & 0xff) + (a >> 16) * ((b >> 8) & 0xff);
}
inline uint32_t __dp2a_hi(uint32_t a, uint32_t b, uint32_t c) { return __dp2a_lo(a, b >> 16, c); }
inline int __dp2a_lo(int a, int b, int c) {
    return c + static_cast<int16_t>(a) * static_cast<int8_t>(b) +
           static_cast<int16_t>(a >> 16) * static_cast<int8_t>(b >> 8);
}
inline int __dp2a_hi(int a, int b, int c) { return __dp2a_lo(a, b >> 16, c); }
