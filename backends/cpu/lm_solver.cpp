// Solves the system of stage lm: control points by themselves (Cholesky of their 6x6 blocks), or all of them by conjugate gradients
// that those blocks precondition. One thread; sums in one order.
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

using D = hn::CappedTag<float, 16>;
using D4 = hn::FixedTag<float, 4>;
constexpr size_t kBlock = 36;

// All of size padded(6 * rows), zero beyond.
HWY_INLINE double product(const float* a, const float* b, size_t count) {
    const D d;
    const size_t lanes = hn::Lanes(d);
    auto even = hn::Zero(d), odd = even;
    size_t i = 0;
    for (; i + 2 * lanes <= count; i += 2 * lanes) {
        even = hn::MulAdd(hn::Load(d, a + i), hn::Load(d, b + i), even);
        odd = hn::MulAdd(hn::Load(d, a + i + lanes), hn::Load(d, b + i + lanes), odd);
    }
    for (; i < count; i += lanes) even = hn::MulAdd(hn::Load(d, a + i), hn::Load(d, b + i), even);
    return double(hn::GetLane(hn::SumOfLanes(d, hn::Add(even, odd))));
}

// y += s x, or y = x + s y
HWY_INLINE void add_scaled(float s, const float* x, float* y, size_t count) {
    const D d;
    const auto factor = hn::Set(d, s);
    for (size_t i = 0; i < count; i += hn::Lanes(d)) hn::Store(hn::MulAdd(factor, hn::Load(d, x + i), hn::Load(d, y + i)), d, y + i);
}
HWY_INLINE void scale_and_add(const float* x, float s, float* y, size_t count) {
    const D d;
    const auto factor = hn::Set(d, s);
    for (size_t i = 0; i < count; i += hn::Lanes(d)) hn::Store(hn::MulAdd(factor, hn::Load(d, y + i), hn::Load(d, x + i)), d, y + i);
}

// A block's 36 entries in registers.
template <class V>
struct Wide {
    static constexpr size_t kVectors = kBlock / hn::MaxLanes(D());
    V part[kVectors];
    hn::Vec<D4> rest;
};
using Block = Wide<hn::Vec<D>>;
static_assert(kBlock % hn::MaxLanes(D()) == 4 || kBlock % hn::MaxLanes(D()) == 0);
constexpr bool kHasRest = kBlock % hn::MaxLanes(D()) != 0;

HWY_INLINE Block load(const float* at) {
    const D d;
    Block b;
    for (size_t i = 0; i < Block::kVectors; ++i) b.part[i] = hn::LoadU(d, at + i * hn::Lanes(d));
    if constexpr (kHasRest) b.rest = hn::LoadU(D4(), at + kBlock - 4);
    return b;
}
HWY_INLINE void store(const Block& b, float* at) {
    const D d;
    for (size_t i = 0; i < Block::kVectors; ++i) hn::StoreU(b.part[i], d, at + i * hn::Lanes(d));
    if constexpr (kHasRest) hn::StoreU(b.rest, D4(), at + kBlock - 4);
}
HWY_INLINE Block multiply_add(const Block& a, const Block& b, const Block& c) {
    Block sum;
    for (size_t i = 0; i < Block::kVectors; ++i) sum.part[i] = hn::MulAdd(a.part[i], b.part[i], c.part[i]);
    if constexpr (kHasRest) sum.rest = hn::MulAdd(a.rest, b.rest, c.rest);
    return sum;
}

// product = matrix * x. Entry by entry a block multiplies its column's x, spread down the columns, for its own row's result, and its row's x,
// repeated across the columns, for the result of the row that its transpose stands in.
HWY_INLINE void multiply(const LowerPattern& pattern, const LmSystem& system, LmWorkspace& work, const float* x, float* result) {
    const size_t rows = pattern.rows();
    for (size_t i = 0; i < rows; ++i)
        for (size_t c = 0; c < 6; ++c) std::fill_n(work.spread.data() + i * kBlock + 6 * c, 6, x[6 * i + c]);
    std::fill(work.transposed.begin(), work.transposed.end(), 0.0f);
    alignas(64) float repeated[kBlock], sums[kBlock];
    for (size_t i = 0; i < rows; ++i) {
        for (size_t c = 0; c < 6; ++c) std::copy_n(x + 6 * i, 6, repeated + 6 * c);
        const Block across = load(repeated);
        const Block zero{};
        Block sum = multiply_add(load(&work.damped[i * kBlock]), load(&work.spread[i * kBlock]), zero);
        for (size_t b = pattern.start[i]; b < pattern.start[i + 1]; ++b) {
            const size_t j = size_t(pattern.column[b]);
            const Block block = load(&system.lower[b * kBlock]);
            sum = multiply_add(block, load(&work.spread[j * kBlock]), sum);
            float* other = &work.transposed[j * kBlock];
            store(multiply_add(block, across, load(other)), other);
        }
        store(sum, sums);
        for (size_t r = 0; r < 6; ++r)
            result[6 * i + r] = ((sums[r] + sums[6 + r]) + (sums[12 + r] + sums[18 + r])) + (sums[24 + r] + sums[30 + r]);
    }
    for (size_t i = 0; i < rows; ++i)
        for (size_t c = 0; c < 6; ++c) {
            const float* t = &work.transposed[i * kBlock + 6 * c];
            result[6 * i + c] += ((t[0] + t[1]) + (t[2] + t[3])) + (t[4] + t[5]);
        }
}

HWY_INLINE void precondition(const LmWorkspace& work, size_t rows, const float* x, float* result) {
    for (size_t i = 0; i < rows; ++i) {
        const float* m = &work.inverse[i * kBlock];
        float sum[6] = {};
        for (size_t c = 0; c < 6; ++c)
            for (size_t r = 0; r < 6; ++r) sum[r] += m[6 * c + r] * x[6 * i + c];
        std::copy(sum, sum + 6, result + 6 * i);
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

namespace {

// Inverse of a symmetric 6x6 block by Cholesky; pivots that vanish in single precision are raised.
void invert(const float* block, float* inverse) {
    float factor[6][6] = {}, own[6][6] = {};  // block = factor factor^T; own = factor^-1
    for (int c = 0; c < 6; ++c) {
        float pivot = block[7 * c];
        for (int k = 0; k < c; ++k) pivot -= factor[c][k] * factor[c][k];
        factor[c][c] = std::sqrt(std::max(pivot, 1e-6f * block[7 * c]));
        const float scale = 1 / factor[c][c];
        for (int r = c + 1; r < 6; ++r) {
            float value = block[6 * c + r];
            for (int k = 0; k < c; ++k) value -= factor[r][k] * factor[c][k];
            factor[r][c] = value * scale;
        }
        own[c][c] = scale;
    }
    for (int c = 0; c < 6; ++c)
        for (int r = c + 1; r < 6; ++r) {
            float value = 0;
            for (int k = c; k < r; ++k) value -= factor[r][k] * own[k][c];
            own[r][c] = value * own[r][r];
        }
    for (int c = 0; c < 6; ++c)
        for (int r = 0; r < 6; ++r) {
            float value = 0;
            for (int k = std::max(r, c); k < 6; ++k) value += own[k][r] * own[k][c];
            inverse[6 * c + r] = value;
        }
}

// Marquardt's damping. What has no weight at all gets one, and stays where it is.
void damp(const SolveTask& task) {
    LmWorkspace& work = *task.workspace;
    for (size_t i = 0; i < task.pattern->rows(); ++i) {
        const float* block = &task.system->diagonal[i * 36];
        float* damped = &work.damped[i * 36];
        std::copy(block, block + 36, damped);
        float trace = 0;
        for (int r = 0; r < 6; ++r) trace += block[7 * r];
        const float least = trace > 0 ? float(kLeastDiagonal) * trace : 1.0f;
        for (int r = 0; r < 6; ++r) damped[7 * r] = block[7 * r] * (1 + task.lambda) + least;
        invert(damped, &work.inverse[i * 36]);
    }
}

}  // namespace

bool solve_system(const SolveTask& task) {
    damp(task);
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
        for (size_t b = pattern.row_start(i); b < pattern.row_start(i + 1) && size_t(pattern.column(b)) < i; ++b)
            column.push_back(pattern.column(b));
        start.push_back(uint32_t(column.size()));
    }
}

size_t LowerPattern::find(int32_t row, int32_t column_of_row) const {
    const auto first = column.begin() + start[size_t(row)], last = column.begin() + start[size_t(row) + 1];
    return size_t(std::lower_bound(first, last, column_of_row) - column.begin());
}

LmSystem::LmSystem(const LowerPattern& pattern, const Host& host)
    : lower(pattern.blocks() * 36, HostAllocator<float>(host)),
      diagonal(pattern.rows() * 36, HostAllocator<float>(host)),
      gradient(pattern.rows() * 6, HostAllocator<float>(host)) {}

void LmSystem::clear() {
    std::fill(lower.begin(), lower.end(), 0.0f);
    std::fill(diagonal.begin(), diagonal.end(), 0.0f);
    std::fill(gradient.begin(), gradient.end(), 0.0f);
}

namespace {
size_t vector_size(const LowerPattern& pattern) { return (pattern.rows() * 6 + 15) / 16 * 16; }
}  // namespace

LmWorkspace::LmWorkspace(const LowerPattern& pattern, const Host& host)
    : damped(pattern.rows() * 36, HostAllocator<float>(host)),
      inverse(damped),
      x(vector_size(pattern), HostAllocator<float>(host)),
      residual(x),
      direction(x),
      product(x),
      conditioned(x),
      spread(damped),
      transposed(damped) {}

}  // namespace defrec::cpu
#endif
