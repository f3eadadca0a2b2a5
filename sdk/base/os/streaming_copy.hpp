// A copy whose result the processor will not look at soon, but a device: it goes past the caches,
// from which a device reads memory at half the speed.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace defrec {

inline void streaming_copy(uint8_t* to, const uint8_t* from, size_t size) {
#if defined(__SSE2__)
    const size_t head = (16 - reinterpret_cast<uintptr_t>(to) % 16) % 16;
    if (size > head) {
        std::memcpy(to, from, head);
        to += head;
        from += head;
        size -= head;
        for (; size >= 16; size -= 16, to += 16, from += 16)
            _mm_stream_si128(reinterpret_cast<__m128i*>(to),
                             _mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
        _mm_sfence();
    }
#endif
    std::memcpy(to, from, size);
}

}  // namespace defrec
