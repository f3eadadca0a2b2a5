// Solves the system of stage lm: control points by themselves (Cholesky of their 6x6 blocks), or
// all of them by conjugate gradients that those blocks precondition. One thread; sums in one order.
#include <cmath>

#include "backends/cpu/lm_system.hpp"
#include "backends/shared/levenberg_marquardt.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/lm_solver.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 8>;
using V = hn::Vec<D>;

// Vectors have padded sizes, zero beyond the last row.
HWY_INLINE double product(const float* a, const float* b, size_t count) {
    const D d;
    const size_t lanes = hn::Lanes(d);
    V even = hn::Zero(d), odd = even;
    for (size_t i = 0; i < count; i += 2 * lanes) {
        even = hn::MulAdd(hn::Load(d, a + i), hn::Load(d, b + i), even);
        odd = hn::MulAdd(hn::Load(d, a + i + lanes), hn::Load(d, b + i + lanes), odd);
    }
    return double(hn::GetLane(hn::SumOfLanes(d, hn::Add(even, odd))));
}

// y += s x
HWY_INLINE void add_scaled(float s, const float* x, float* y, size_t count) {
    const D d;
    const V factor = hn::Set(d, s);
    for (size_t i = 0; i < count; i += hn::Lanes(d))
        hn::Store(hn::MulAdd(factor, hn::Load(d, x + i), hn::Load(d, y + i)), d, y + i);
}
// y = x + s y
HWY_INLINE void scale_and_add(const float* x, float s, float* y, size_t count) {
    const D d;
    const V factor = hn::Set(d, s);
    for (size_t i = 0; i < count; i += hn::Lanes(d))
        hn::Store(hn::MulAdd(factor, hn::Load(d, y + i), hn::Load(d, x + i)), d, y + i);
}

// A block in registers.
struct Block {
    V part[kBlockFloats / hn::MaxLanes(D())];
    static constexpr size_t kParts = kBlockFloats / hn::MaxLanes(D());
};
HWY_INLINE Block load(const float* at) {
    Block b;
    for (size_t i = 0; i < Block::kParts; ++i) b.part[i] = hn::Load(D(), at + i * hn::Lanes(D()));
    return b;
}
HWY_INLINE void store(const Block& b, float* at) {
    for (size_t i = 0; i < Block::kParts; ++i) hn::Store(b.part[i], D(), at + i * hn::Lanes(D()));
}
HWY_INLINE Block multiply_add(const Block& a, const Block& b, const Block& c) {
    Block sum;
    for (size_t i = 0; i < Block::kParts; ++i)
        sum.part[i] = hn::MulAdd(a.part[i], b.part[i], c.part[i]);
    return sum;
}

// Each of a row's six numbers down a column of a block.
HWY_INLINE void spread(const float* x, float* block) {
    for (size_t c = 0; c < 6; ++c)
        for (size_t r = 0; r < 6; ++r) block[6 * c + r] = x[c];
}
// The six numbers as every column.
HWY_INLINE void repeat(const float* x, float* block) {
    for (size_t c = 0; c < 6; ++c)
        for (size_t r = 0; r < 6; ++r) block[6 * c + r] = x[r];
}

// result = matrix * x. Entry by entry a block multiplies its column's x, spread, for its own row's
// result, and its row's x, repeated, for the result of the row that its transpose stands in; the
// entries are added up at the end of each row.
HWY_INLINE void multiply(const LowerPattern& pattern, const LmSystem& system, LmWorkspace& work,
                         const float* x, float* result) {
    const size_t rows = pattern.rows();
    for (size_t i = 0; i < rows; ++i) spread(x + 6 * i, &work.spread[i * kBlockFloats]);
    std::fill(work.transposed.begin(), work.transposed.end(), 0.0f);
    alignas(64) float repeated[kBlockFloats] = {}, sums[kBlockFloats], none[kBlockFloats] = {};
    for (size_t i = 0; i < rows; ++i) {
        repeat(x + 6 * i, repeated);
        const Block across = load(repeated);
        Block sum = multiply_add(load(&work.damped[i * kBlockFloats]),
                                 load(&work.spread[i * kBlockFloats]), load(none));
        for (size_t b = pattern.start[i]; b < pattern.start[i + 1]; ++b) {
            const size_t j = size_t(pattern.column[b]);
            const Block block = load(&system.lower[b * kBlockFloats]);
            sum = multiply_add(block, load(&work.spread[j * kBlockFloats]), sum);
            float* other = &work.transposed[j * kBlockFloats];
            store(multiply_add(block, across, load(other)), other);
        }
        store(sum, sums);
        for (size_t r = 0; r < 6; ++r)
            result[6 * i + r] = ((sums[r] + sums[6 + r]) + (sums[12 + r] + sums[18 + r])) +
                                (sums[24 + r] + sums[30 + r]);
    }
    for (size_t i = 0; i < rows; ++i)
        for (size_t c = 0; c < 6; ++c) {
            const float* t = &work.transposed[i * kBlockFloats + 6 * c];
            result[6 * i + c] += ((t[0] + t[1]) + (t[2] + t[3])) + (t[4] + t[5]);
        }
}

// result = inverse diagonal * x. Columns are read eight wide; what lies beyond six is overwritten
// by the next row, or is padding.
HWY_INLINE void precondition(const LmWorkspace& work, size_t rows, const float* x, float* result) {
    const hn::FixedTag<float, 4> d4;
    for (size_t i = 0; i < rows; ++i) {
        const float* m = &work.inverse[i * kBlockFloats];
        auto low = hn::Zero(d4), high = low;
        for (size_t c = 0; c < 6; ++c) {
            const auto factor = hn::Set(d4, x[6 * i + c]);
            low = hn::MulAdd(hn::LoadU(d4, m + 6 * c), factor, low);
            high = hn::MulAdd(hn::LoadU(d4, m + 6 * c + 4), factor, high);
        }
        hn::StoreU(low, d4, result + 6 * i);
        hn::StoreU(high, d4, result + 6 * i + 4);
    }
    std::fill(result + 6 * rows, result + work.x.size(), 0.0f);
}

// Inverses of the damped diagonal blocks by Cholesky, a block in each lane. Pivots that vanish in
// single precision are raised.
void InvertDiagonal(const SolveTask& task) {
    const D d;
    const hn::Rebind<int32_t, D> di;
    const size_t lanes = hn::Lanes(d), rows = task.pattern->rows();
    LmWorkspace& work = *task.workspace;
    alignas(64) float out[kBlockFloats * 8];
    for (size_t i = 0; i < rows; i += lanes) {
        const auto index =
            hn::Mul(hn::Min(hn::Iota(di, int32_t(i)), hn::Set(di, int32_t(rows) - 1)),
                    hn::Set(di, int32_t(kBlockFloats)));
        V factor[6][6], own[6][6];  // block = factor factor^T; own = factor^-1
        for (size_t c = 0; c < 6; ++c)
            for (size_t r = c; r < 6; ++r) {
                V value = hn::GatherIndex(d, work.damped.data() + 6 * c + r, index);
                const V minimum = hn::Mul(value, hn::Set(d, 1e-6f));
                for (size_t k = 0; k < c; ++k)
                    value = hn::NegMulAdd(factor[r][k], factor[c][k], value);
                if (r == c)
                    own[c][c] =
                        hn::Div(hn::Set(d, 1.0f), factor[c][c] = hn::Sqrt(hn::Max(value, minimum)));
                else
                    factor[r][c] = hn::Mul(value, own[c][c]);
            }
        for (size_t c = 0; c < 6; ++c)
            for (size_t r = c + 1; r < 6; ++r) {
                V value = hn::Zero(d);
                for (size_t k = c; k < r; ++k)
                    value = hn::NegMulAdd(factor[r][k], own[k][c], value);
                own[r][c] = hn::Mul(value, own[r][r]);
            }
        V inverse[kBlockFloats];
        for (size_t c = 0; c < 6; ++c)
            for (size_t r = 0; r <= c; ++r) {
                V value = hn::Mul(own[c][r], own[c][c]);
                for (size_t k = c + 1; k < 6; ++k) value = hn::MulAdd(own[k][r], own[k][c], value);
                inverse[6 * c + r] = inverse[6 * r + c] = value;
            }
        for (size_t k = 36; k < kBlockFloats; ++k) inverse[k] = hn::Zero(d);
        for (size_t k = 0; k < kBlockFloats; k += 4)
            hn::StoreInterleaved4(inverse[k], inverse[k + 1], inverse[k + 2], inverse[k + 3], d,
                                  out + k * lanes);
        for (size_t lane = 0; lane < std::min(lanes, rows - i); ++lane)
            for (size_t k = 0; k < kBlockFloats; k += 4)
                std::copy_n(out + k * lanes + 4 * lane, 4,
                            &work.inverse[(i + lane) * kBlockFloats + k]);
    }
}

void ConjugateGradients(const SolveTask& task) {
    LmWorkspace& work = *task.workspace;
    const size_t rows = task.pattern->rows(), count = work.x.size();
    std::fill(work.x.begin(), work.x.end(), 0.0f);
    for (size_t i = 0; i < 6 * rows; ++i) work.residual[i] = -task.system->gradient[i];
    precondition(work, rows, work.residual.data(), work.conditioned.data());
    std::copy(work.conditioned.begin(), work.conditioned.end(), work.direction.begin());
    double rho = product(work.residual.data(), work.conditioned.data(), count);
    const double enough = kConjugateTolerance * kConjugateTolerance * rho;
    for (uint32_t i = 0; i < task.iterations && rho > enough; ++i) {
        multiply(*task.pattern, *task.system, work, work.direction.data(), work.product.data());
        const double curvature = product(work.direction.data(), work.product.data(), count);
        if (!(curvature > 0)) break;
        const float alpha = float(rho / curvature);
        add_scaled(alpha, work.direction.data(), work.x.data(), count);
        add_scaled(-alpha, work.product.data(), work.residual.data(), count);
        precondition(work, rows, work.residual.data(), work.conditioned.data());
        const double next = product(work.residual.data(), work.conditioned.data(), count);
        scale_and_add(work.conditioned.data(), float(next / rho), work.direction.data(), count);
        rho = next;
    }
}

void Independent(const SolveTask& task) {
    LmWorkspace& work = *task.workspace;
    const size_t rows = task.pattern->rows();
    for (size_t i = 0; i < 6 * rows; ++i) work.residual[i] = -task.system->gradient[i];
    precondition(work, rows, work.residual.data(), work.x.data());
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace defrec::cpu {

HWY_EXPORT(ConjugateGradients);
HWY_EXPORT(Independent);
HWY_EXPORT(InvertDiagonal);

namespace {

// Marquardt's damping. What has no weight at all gets one, and stays where it is.
void damp(const SolveTask& task) {
    LmWorkspace& work = *task.workspace;
    for (size_t i = 0; i < task.pattern->rows(); ++i) {
        const float* block = &task.system->diagonal[i * kBlockFloats];
        float* damped = &work.damped[i * kBlockFloats];
        std::copy(block, block + kBlockFloats, damped);
        float trace = 0;
        for (int r = 0; r < 6; ++r) trace += block[7 * r];
        const float minimum = trace > 0 ? float(kMinDiagonal) * trace : 1.0f;
        for (int r = 0; r < 6; ++r) damped[7 * r] = block[7 * r] * (1 + task.lambda) + minimum;
    }
}

}  // namespace

bool solve_system(const SolveTask& task) {
    damp(task);
    HWY_DYNAMIC_DISPATCH(InvertDiagonal)(task);
    if (task.iterations > 0)
        HWY_DYNAMIC_DISPATCH(ConjugateGradients)(task);
    else
        HWY_DYNAMIC_DISPATCH(Independent)(task);
    for (const float value : task.workspace->x)
        if (!std::isfinite(value)) return false;
    return true;
}

LowerPattern::LowerPattern(const BlockPattern& pattern, const Host& host)
    : start(HostAllocator<uint32_t>(host)), column(HostAllocator<int32_t>(host)) {
    start.push_back(0);
    for (size_t i = 0; i < pattern.rows(); ++i) {
        for (size_t b = pattern.row_start(i);
             b < pattern.row_start(i + 1) && size_t(pattern.column(b)) < i; ++b)
            column.push_back(pattern.column(b));
        start.push_back(uint32_t(column.size()));
    }
}

size_t LowerPattern::find(int32_t row, int32_t column_of_row) const {
    const auto first = column.begin() + start[size_t(row)],
               last = column.begin() + start[size_t(row) + 1];
    return size_t(std::lower_bound(first, last, column_of_row) - column.begin());
}

LmSystem::LmSystem(const LowerPattern& pattern, const Host& host)
    : lower(pattern.blocks() * kBlockFloats, HostAllocator<float>(host)),
      diagonal(pattern.rows() * kBlockFloats, HostAllocator<float>(host)),
      gradient(pattern.rows() * 6, HostAllocator<float>(host)) {}

LmWorkspace::LmWorkspace(const LowerPattern& pattern, const Host& host)
    : damped(pattern.rows() * kBlockFloats, HostAllocator<float>(host)),
      inverse(damped),
      x((pattern.rows() * 6 + 2 + 15) / 16 * 16, HostAllocator<float>(host)),
      residual(x),
      direction(x),
      product(x),
      conditioned(x),
      spread(damped),
      transposed(damped) {}

}  // namespace defrec::cpu
#endif
