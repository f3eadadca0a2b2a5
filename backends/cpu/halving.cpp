#include "backends/cpu/halving.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/halving.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace {

// The pixel of a block of 2x2: from the even and odd pixels of the upper row, then of the lower
// one, 16 bits each; and likewise without lanes for the rest of a row.
struct RoundedMean {
    template <class D, class V>
    static HWY_INLINE V lanes(D d, V a, V b, V c, V e) {
        return hn::ShiftRight<2>(hn::Add(hn::Add(hn::Add(a, b), hn::Add(c, e)), hn::Set(d, 2)));
    }
    static HWY_INLINE int scalar(int a, int b, int c, int d) { return (a + b + c + d + 2) >> 2; }
};
struct AllUsable {
    template <class D, class V>
    static HWY_INLINE V lanes(D d, V a, V b, V c, V e) {
        return hn::Min(hn::Min(hn::Min(a, b), hn::Min(c, e)), hn::Set(d, 1));
    }
    static HWY_INLINE int scalar(int a, int b, int c, int d) {
        return a != 0 && b != 0 && c != 0 && d != 0;
    }
};

template <class Block>
HWY_INLINE void halve(const uint8_t* in, size_t in_stride, uint8_t* out, size_t out_stride,
                      int32_t out_width, int32_t first, int32_t last) {
    const hn::ScalableTag<uint16_t> d16;
    const hn::Repartition<uint8_t, decltype(d16)> d8;
    const hn::Rebind<uint8_t, decltype(d16)> half;
    const auto low = hn::Set(d16, 255);
    const int32_t count = int32_t(hn::Lanes(d16));
    for (int32_t y = first; y < last; ++y) {
        const uint8_t* upper = in + size_t(2 * y) * in_stride;
        const uint8_t* lower = upper + in_stride;
        uint8_t* to = out + size_t(y) * out_stride;
        int32_t x = 0;
        for (; x + count <= out_width; x += count) {
            const auto u = hn::BitCast(d16, hn::LoadU(d8, upper + 2 * x)),
                       l = hn::BitCast(d16, hn::LoadU(d8, lower + 2 * x));
            const auto value = Block::lanes(d16, hn::And(u, low), hn::ShiftRight<8>(u),
                                            hn::And(l, low), hn::ShiftRight<8>(l));
            hn::StoreU(hn::DemoteTo(half, hn::BitCast(hn::RebindToSigned<decltype(d16)>(), value)),
                       half, to + x);
        }
        for (; x < out_width; ++x)
            to[x] = uint8_t(
                Block::scalar(upper[2 * x], upper[2 * x + 1], lower[2 * x], lower[2 * x + 1]));
    }
}

void halve_gray(const uint8_t* in, size_t in_stride, uint8_t* out, size_t out_stride,
                int32_t out_width, int32_t first, int32_t last) {
    halve<RoundedMean>(in, in_stride, out, out_stride, out_width, first, last);
}
void halve_mask(const uint8_t* in, size_t in_stride, uint8_t* out, size_t out_stride,
                int32_t out_width, int32_t first, int32_t last) {
    halve<AllUsable>(in, in_stride, out, out_stride, out_width, first, last);
}

}  // namespace
}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(halve_gray);
HWY_EXPORT(halve_mask);
void halve_gray(const uint8_t* in, size_t in_stride, uint8_t* out, size_t out_stride,
                int32_t out_width, int32_t first, int32_t last) {
    HWY_DYNAMIC_DISPATCH(halve_gray)(in, in_stride, out, out_stride, out_width, first, last);
}
void halve_mask(const uint8_t* in, size_t in_stride, uint8_t* out, size_t out_stride,
                int32_t out_width, int32_t first, int32_t last) {
    HWY_DYNAMIC_DISPATCH(halve_mask)(in, in_stride, out, out_stride, out_width, first, last);
}

}  // namespace defrec::cpu
#endif
