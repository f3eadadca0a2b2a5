// Sums over the rows of a sampled patch. Included once per target by the files of align that use
// Highway's foreach_target.
#include <hwy/highway.h>

#include "backends/cpu/align_kernels.hpp"

#if defined(DEFREC_CPU_ALIGN_LANES) == defined(HWY_TARGET_TOGGLE)
#ifdef DEFREC_CPU_ALIGN_LANES
#undef DEFREC_CPU_ALIGN_LANES
#else
#define DEFREC_CPU_ALIGN_LANES
#endif

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DRow = hn::CappedTag<int16_t, kAlignRow>;
using DPairs = hn::Repartition<int32_t, DRow>;
using DFour = hn::CappedTag<int32_t, 4>;

// Adds up products of 16-bit values.
class RowSum {
  public:
    RowSum() : sum_(hn::Zero(DPairs())), rest_(hn::Zero(DPairs())) {}
    HWY_INLINE void add(hn::Vec<DRow> a, hn::Vec<DRow> b) {
        sum_ = hn::ReorderWidenMulAccumulate(DPairs(), a, b, sum_, rest_);
    }
    HWY_INLINE hn::Vec<DPairs> lanes() const { return hn::Add(sum_, rest_); }

  private:
    hn::Vec<DPairs> sum_, rest_;
};

template <class D>
HWY_INLINE hn::Vec<DFour> add_blocks(D, hn::Vec<D> v) {
    if constexpr (hn::MaxLanes(D()) > 4)
        return hn::Add(hn::LowerHalf(DFour(), v), hn::UpperHalf(DFour(), v));
    else
        return v;
}

// The totals of four at a time: a shuffle serves them all.
HWY_INLINE hn::Vec<DFour> totals(const RowSum& a, const RowSum& b, const RowSum& c,
                                 const RowSum& e) {
    const DPairs d;
    const hn::Repartition<int64_t, DPairs> wide;
    const auto halves = [&](const RowSum& left, const RowSum& right) HWY_ATTR {
        const auto l = left.lanes(), r = right.lanes();
        return hn::BitCast(wide,
                           hn::Add(hn::InterleaveLower(d, l, r), hn::InterleaveUpper(d, l, r)));
    };
    const auto ab = halves(a, b), ce = halves(c, e);
    const auto sums = hn::Add(hn::BitCast(d, hn::InterleaveLower(wide, ab, ce)),
                              hn::BitCast(d, hn::InterleaveUpper(wide, ab, ce)));
    return add_blocks(d, sums);
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
