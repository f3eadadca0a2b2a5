// See gray_copy.hpp.
#include "sdk/tracking/frame/gray_copy.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "backends/shared/gray.hpp"
#include "include/defrec_c.h"
#include "sdk/base/os/streaming_copy.hpp"
#include "sdk/contract/pixel_format.hpp"
#if defined(__x86_64__)
#include <tmmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace defrec {
namespace {

constexpr size_t kVector = 16;  // pixels

// Which bytes of a pixel the colours are.
struct Order {
    size_t red, green, blue;
};

template <size_t kBytes>
void copy_one_by_one(Order order, const uint8_t* from, size_t pixels, uint8_t* to) {
    for (size_t i = 0; i < pixels; ++i, from += kBytes)
        to[i] = static_cast<uint8_t>(gray_of(from[order.red], from[order.green], from[order.blue]));
}

#if defined(__x86_64__)

bool has_vectors() {
    static const bool has = __builtin_cpu_supports("ssse3") != 0;
    return has;
}

// Pixels that a vector is made of, and where the first one begins in the vector that is loaded: of
// the last four pixels of three bytes those before are loaded too, not those behind.
constexpr size_t kGroup = 4, kGroups = kVector / kGroup;
template <size_t kBytes>
constexpr size_t first_byte(size_t group) {
    return kBytes == 3 && group == kGroups - 1 ? 4 : 0;
}

// For _mm_maddubs_epi16, whose sums of two products have 15 bits: green is added to both others.
constexpr int kGreenWithRed = 51, kGreenWithBlue = kGreenWeight - kGreenWithRed;
static_assert(255 * (kRedWeight + kGreenWithRed) < 32768);
static_assert(255 * (kBlueWeight + kGreenWithBlue) < 32768);

// For _mm_shuffle_epi8: red and green of each pixel, then green and blue.
template <size_t kBytes>
__m128i selection(Order order, size_t group) {
    alignas(16) uint8_t byte[16];
    for (size_t i = 0; i < kGroup; ++i) {
        const size_t at = first_byte<kBytes>(group) + kBytes * i;
        byte[2 * i] = static_cast<uint8_t>(at + order.red);
        byte[2 * i + 1] = byte[8 + 2 * i] = static_cast<uint8_t>(at + order.green);
        byte[8 + 2 * i + 1] = static_cast<uint8_t>(at + order.blue);
    }
    return _mm_load_si128(reinterpret_cast<const __m128i*>(byte));
}

// pixels: a multiple of kVector; to: aligned where it streams.
template <size_t kBytes>
__attribute__((target("ssse3"))) void copy_vectors(Order order, const uint8_t* from, size_t pixels,
                                                   uint8_t* to, bool streams, size_t ahead) {
    const __m128i chosen = selection<kBytes>(order, 0),
                  chosen_last = selection<kBytes>(order, kGroups - 1), half = _mm_set1_epi16(128);
    const __m128i weights = _mm_unpacklo_epi64(_mm_set1_epi16(kRedWeight | kGreenWithRed << 8),
                                               _mm_set1_epi16(kGreenWithBlue | kBlueWeight << 8));
    // Both sums of each pixel, those with red in the lower half.
    const auto sums = [&](const uint8_t* pixel, size_t group) __attribute__((target("ssse3"))) {
        const auto* at = reinterpret_cast<const __m128i*>(pixel + kBytes * kGroup * group -
                                                          first_byte<kBytes>(group));
        return _mm_maddubs_epi16(
            _mm_shuffle_epi8(_mm_loadu_si128(at), group == kGroups - 1 ? chosen_last : chosen),
            weights);
    };
    const auto gray = [&](__m128i a, __m128i b) __attribute__((target("ssse3"))) {
        const __m128i sum = _mm_add_epi16(_mm_unpacklo_epi64(a, b), _mm_unpackhi_epi64(a, b));
        return _mm_srli_epi16(_mm_add_epi16(sum, half), 8);
    };
    for (size_t i = 0; i < pixels; i += kVector, from += kBytes * kVector) {
        _mm_prefetch(reinterpret_cast<const char*>(reinterpret_cast<uintptr_t>(from) + ahead),
                     _MM_HINT_T0);
        const __m128i value = _mm_packus_epi16(gray(sums(from, 0), sums(from, 1)),
                                               gray(sums(from, 2), sums(from, 3)));
        auto* const at = reinterpret_cast<__m128i*>(to + i);
        if (streams)
            _mm_stream_si128(at, value);
        else
            _mm_storeu_si128(at, value);
    }
    if (streams) _mm_sfence();
}

#elif defined(__aarch64__)

bool has_vectors() { return true; }

inline uint8x16x3_t load_pixels(const uint8_t* from, std::integral_constant<size_t, 3>) {
    return vld3q_u8(from);
}
inline uint8x16x4_t load_pixels(const uint8_t* from, std::integral_constant<size_t, 4>) {
    return vld4q_u8(from);
}

inline uint8x8_t gray_of_half(uint8x8_t red, uint8x8_t green, uint8x8_t blue) {
    uint16x8_t sum = vmull_u8(red, vdup_n_u8(kRedWeight));
    sum = vmlal_u8(sum, green, vdup_n_u8(kGreenWeight));
    sum = vmlal_u8(sum, blue, vdup_n_u8(kBlueWeight));
    return vrshrn_n_u16(sum, 8);
}

template <size_t kBytes>
void copy_vectors(Order order, const uint8_t* from, size_t pixels, uint8_t* to, bool, size_t) {
    for (size_t i = 0; i < pixels; i += kVector, from += kBytes * kVector) {
        const auto pixel = load_pixels(from, std::integral_constant<size_t, kBytes>());
        const uint8x16_t red = pixel.val[order.red], green = pixel.val[order.green],
                         blue = pixel.val[order.blue];
        vst1q_u8(
            to + i,
            vcombine_u8(gray_of_half(vget_low_u8(red), vget_low_u8(green), vget_low_u8(blue)),
                        gray_of_half(vget_high_u8(red), vget_high_u8(green), vget_high_u8(blue))));
    }
}

#else

bool has_vectors() { return false; }

template <size_t kBytes>
void copy_vectors(Order order, const uint8_t* from, size_t pixels, uint8_t* to, bool, size_t) {
    copy_one_by_one<kBytes>(order, from, pixels, to);
}

#endif

template <size_t kBytes>
void copy_colours(Order order, const uint8_t* from, size_t pixels, uint8_t* to, bool streams,
                  size_t ahead) {
    size_t head = 0, whole = 0;
    if (has_vectors()) {
        head = streams ? (kVector - reinterpret_cast<uintptr_t>(to) % kVector) % kVector : 0;
        head = std::min(head, pixels);
        whole = (pixels - head) / kVector * kVector;
    }
    copy_one_by_one<kBytes>(order, from, head, to);
    copy_vectors<kBytes>(order, from + kBytes * head, whole, to + head, streams, ahead);
    const size_t done = head + whole;
    copy_one_by_one<kBytes>(order, from + kBytes * done, pixels - done, to + done);
}

}  // namespace

void copy_gray(uint32_t format, const uint8_t* from, size_t pixels, uint8_t* to, bool streams,
               size_t ahead) {
    if (pixels == 0) return;  // pointers may be null, which memcpy may not be given
    if (format == DEFREC_FORMAT_GRAY8) {
        if (streams)
            streaming_copy(to, from, pixels);
        else
            std::memcpy(to, from, pixels);
        return;
    }
    const Order order = format == DEFREC_FORMAT_RGB8 ? Order{0, 1, 2} : Order{2, 1, 0};
    if (bytes_per_pixel(format) == 3)
        copy_colours<3>(order, from, pixels, to, streams, ahead);
    else
        copy_colours<4>(order, from, pixels, to, streams, ahead);
}

}  // namespace defrec
