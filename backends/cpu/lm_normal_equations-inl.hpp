// J^T J and J^T r of one group's rows, with rows in SIMD lanes. Included once per target by files
// that use Highway's foreach_target.
//
// Rows are stored in fours, in seven pieces of 16 floats; piece g holds entries 4 g .. 4 g + 3 of
// each row, row after row, and the last piece holds the residual. So a vector of L floats holds the
// same four entries of L / 4 rows, and a product of a broadcast entry with it adds to the same
// column of L / 4 partial sums of the 24 x 24 matrix.
#include <hwy/highway.h>

#include <cstring>

#include "backends/cpu/lm_groups.hpp"
#include "backends/cpu/surface_lanes-inl.hpp"

#if defined(DEFREC_CPU_LM_NORMAL_EQUATIONS) == defined(HWY_TARGET_TOGGLE)
#ifdef DEFREC_CPU_LM_NORMAL_EQUATIONS
#undef DEFREC_CPU_LM_NORMAL_EQUATIONS
#else
#define DEFREC_CPU_LM_NORMAL_EQUATIONS
#endif

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {

constexpr size_t kPieces = kJacobian / 4;

// Lower triangle of J^T J by columns, in pieces of four rows: entry (r, c) at c * kJacobian + r,
// for r / 4 >= c / 4.
struct alignas(64) NormalEquations {
    float matrix[kJacobian * kJacobian];
    float gradient[kJacobian];
};

using D4 = hn::FixedTag<float, 4>;

template <class D, class V = hn::Vec<D>>
HWY_INLINE hn::Vec<D4> fold([[maybe_unused]] D d, V v) {
    if constexpr (hn::MaxLanes(D()) == 4) {
        return v;
    } else {
        const hn::Half<D> half;
        return fold(half, hn::Add(hn::LowerHalf(half, v), hn::UpperHalf(half, v)));
    }
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE void store_sum(D d, V sum, float* four) {
    hn::Store(fold(d, sum), D4(), four);
}

// Columns 4 gc .. 4 gc + 3, rows from piece gr: one piece, or two where that many are left.
template <bool kTwo, class D>
HWY_INLINE void multiply_pieces(D d, const float* rows, size_t fours, size_t gc, size_t gr,
                                float* matrix) {
    using V = hn::Vec<D>;
    const size_t lanes = hn::Lanes(d);
    V a0 = hn::Zero(d), a1 = a0, a2 = a0, a3 = a0, b0 = a0, b1 = a0, b2 = a0, b3 = a0;
    for (size_t v = 0; v < fours; ++v) {
        for (size_t part = 0; part < 16; part += lanes) {
            const float* at = rows + v * kFourRows + part;
            const V column = hn::Load(d, at + gc * 16), first = hn::Load(d, at + gr * 16);
            const V c0 = hn::Broadcast<0>(column), c1 = hn::Broadcast<1>(column),
                    c2 = hn::Broadcast<2>(column), c3 = hn::Broadcast<3>(column);
            a0 = hn::MulAdd(c0, first, a0);
            a1 = hn::MulAdd(c1, first, a1);
            a2 = hn::MulAdd(c2, first, a2);
            a3 = hn::MulAdd(c3, first, a3);
            if constexpr (kTwo) {
                const V second = hn::Load(d, at + (gr + 1) * 16);
                b0 = hn::MulAdd(c0, second, b0);
                b1 = hn::MulAdd(c1, second, b1);
                b2 = hn::MulAdd(c2, second, b2);
                b3 = hn::MulAdd(c3, second, b3);
            }
        }
    }
    float* out = matrix + 4 * gc * kJacobian + 4 * gr;
    store_sum(d, a0, out);
    store_sum(d, a1, out + kJacobian);
    store_sum(d, a2, out + 2 * kJacobian);
    store_sum(d, a3, out + 3 * kJacobian);
    if constexpr (kTwo) {
        store_sum(d, b0, out + 4);
        store_sum(d, b1, out + kJacobian + 4);
        store_sum(d, b2, out + 2 * kJacobian + 4);
        store_sum(d, b3, out + 3 * kJacobian + 4);
    }
}

template <class D>
HWY_NOINLINE void multiply_rows(D d, const float* rows, size_t fours, NormalEquations& out) {
    using V = hn::Vec<D>;
    const size_t lanes = hn::Lanes(d);
    for (size_t gc = 0; gc < kPieces; ++gc) {
        size_t gr = gc;
        for (; gr + 1 < kPieces; gr += 2) multiply_pieces<true>(d, rows, fours, gc, gr, out.matrix);
        if (gr < kPieces) multiply_pieces<false>(d, rows, fours, gc, gr, out.matrix);
    }
    V sum[kPieces];
    for (size_t g = 0; g < kPieces; ++g) sum[g] = hn::Zero(d);
    for (size_t v = 0; v < fours; ++v)
        for (size_t part = 0; part < 16; part += lanes) {
            const float* at = rows + v * kFourRows + part;
            const V residual = hn::Broadcast<0>(hn::Load(d, at + kPieces * 16));
            for (size_t g = 0; g < kPieces; ++g)
                sum[g] = hn::MulAdd(residual, hn::Load(d, at + g * 16), sum[g]);
        }
    for (size_t g = 0; g < kPieces; ++g) store_sum(d, sum[g], out.gradient + 4 * g);
}

// The matrix cut into the control points' blocks.
inline void cut_blocks(NormalEquations& equations, LmGroupSums& sums) {
    float* m = equations.matrix;
    for (size_t c = 0; c < kJacobian;
         ++c)  // the part of the diagonal blocks above the pieces on the diagonal
        for (size_t r = c / 6 * 6; r < c / 4 * 4; ++r) m[c * kJacobian + r] = m[r * kJacobian + c];
    size_t pair = 0;
    for (size_t k = 0; k < kBlendNodes; ++k)
        for (size_t l = 0; l <= k; ++l, ++pair)
            for (size_t c = 0; c < 6; ++c)
                std::memcpy(&sums.blocks[pair][6 * c], &m[(6 * l + c) * kJacobian + 6 * k],
                            6 * sizeof(float));
    std::memcpy(sums.gradient, equations.gradient, sizeof sums.gradient);
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
