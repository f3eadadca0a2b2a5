// Vector helpers of the stereo kernels; included once per Highway target.
#if defined(DEFREC_STEREO_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef DEFREC_STEREO_LANES_INL
#undef DEFREC_STEREO_LANES_INL
#else
#define DEFREC_STEREO_LANES_INL
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using I32 = hn::ScalableTag<int32_t>;
using F32 = hn::ScalableTag<float>;
using I16 = hn::ScalableTag<int16_t>;
using VI32 = hn::Vec<I32>;
using VF32 = hn::Vec<F32>;

// x, x + 1, ... Highway's Iota of a variable goes through memory, lane by lane.
HWY_INLINE VI32 Columns(int x) { return hn::Add(hn::Iota(I32(), 0), hn::Set(I32(), x)); }

// For each int32 lane the sum of the products of its two int16 halves.
HWY_INLINE VI32 PairProducts(VI32 a, VI32 b) {
#if HWY_ARCH_X86
    const I32 d32;
    const hn::Repartition<int16_t, I32> d16;
    VI32 unused = hn::Zero(d32);
    return hn::ReorderWidenMulAccumulate(d32, hn::BitCast(d16, a), hn::BitCast(d16, b),
                                         hn::Zero(d32), unused);
#else
    const auto low = [](VI32 v) HWY_ATTR { return hn::ShiftRight<16>(hn::ShiftLeft<16>(v)); };
    return hn::Add(hn::Mul(low(a), low(b)), hn::Mul(hn::ShiftRight<16>(a), hn::ShiftRight<16>(b)));
#endif
}

// The kCount lanes before those of current, then current's but for as many; kCount < 4.
template <int kCount>
HWY_INLINE VI32 Before(VI32 previous, VI32 current) {
#if HWY_TARGET == HWY_AVX3
    return VI32{_mm512_alignr_epi32(current.raw, previous.raw, 16 - kCount)};
#else
    const I32 d;
    VI32 middle = previous;
    if constexpr (hn::MaxLanes(d) == 8) middle = hn::ConcatLowerUpper(d, current, previous);
    return hn::CombineShiftRightBytes<16 - 4 * kCount>(d, current, middle);
#endif
}
// Current's lanes but for the first kCount, then as many of next; kCount < 4.
template <int kCount>
HWY_INLINE VI32 After(VI32 current, VI32 next) {
#if HWY_TARGET == HWY_AVX3
    return VI32{_mm512_alignr_epi32(next.raw, current.raw, kCount)};
#else
    const I32 d;
    VI32 middle = next;
    if constexpr (hn::MaxLanes(d) == 8) middle = hn::ConcatLowerUpper(d, next, current);
    return hn::CombineShiftRightBytes<4 * kCount>(d, middle, current);
#endif
}

// Bytes 2 i and 2 i + 1 of a row in each lane, the second in the bits above the first's.
HWY_INLINE VI32 BytePairs(const uint8_t* row) {
    const hn::Rebind<uint16_t, I32> d16;
    return hn::PromoteTo(I32(), hn::LoadU(d16, reinterpret_cast<const uint16_t*>(row)));
}

// Sums of the nine columns round every second one, while vectors of even and odd columns come in:
// four pairs of an even and the odd one behind it, and another even one. Loads that straddle cache
// lines would take as long as all else.
class NineColumns {
  public:
    // The first vectors. Those before are zeros: sums that need them are of no window.
    NineColumns(VI32 even, VI32 odd)
        : even_(even), pair_(hn::Add(even, odd)), two_pairs_before_(hn::Zero(I32())) {}
    // The sums round the even columns of the vector before; then the next.
    HWY_INLINE VI32 Step(VI32 even, VI32 odd) {
        const VI32 pair = hn::Add(even, odd), two_pairs = hn::Add(pair_, After<1>(pair_, pair));
        const VI32 sum = hn::Add(hn::Add(Before<2>(two_pairs_before_, two_pairs), two_pairs),
                                 After<2>(even_, even));
        even_ = even;
        pair_ = pair;
        two_pairs_before_ = two_pairs;
        return sum;
    }

  private:
    VI32 even_, pair_, two_pairs_before_;
};

// 1 / sqrt(value) as the definition has it; 0 for 0.
HWY_INLINE VF32 InverseRoot(VI32 value) {
    const I32 d32;
    const F32 df;
    const VF32 x = hn::ConvertTo(df, value);
    VF32 y =
        hn::BitCast(df, hn::Sub(hn::Set(d32, 0x5f375a86), hn::ShiftRight<1>(hn::BitCast(d32, x))));
    const VF32 half = hn::Mul(hn::Set(df, 0.5f), x);
    for (int step = 0; step < 2; ++step)
        y = hn::Mul(y, hn::Sub(hn::Set(df, 1.5f), hn::Mul(hn::Mul(half, y), y)));
    return hn::IfThenElseZero(hn::RebindMask(df, hn::Gt(value, hn::Zero(d32))), y);
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
