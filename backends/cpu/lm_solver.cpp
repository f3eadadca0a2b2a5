// Solves the system of stage lm: control points by themselves (Cholesky of their 6x6 blocks), or
// all of them by conjugate gradients that those blocks precondition. The rows are cut into parts by
// the pattern alone; each is one thread's at a time, and sums are added in the order of the parts.
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

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
using D2 = hn::FixedTag<float, 2>;
using D4 = hn::FixedTag<float, 4>;
using V4 = hn::Vec<D4>;

// Sums over the numbers [first, last) of vectors; the bounds are multiples of 16.
HWY_INLINE double product(const float* a, const float* b, size_t first, size_t last) {
    const D d;
    const size_t lanes = hn::Lanes(d);
    V even = hn::Zero(d), odd = even;
    for (size_t i = first; i < last; i += 2 * lanes) {
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
HWY_INLINE void add_to_scaled(const float* x, float s, float* y, size_t count) {
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

HWY_INLINE Block multiply(const Block& a, const Block& b) {
    Block product;
    for (size_t i = 0; i < Block::kParts; ++i) product.part[i] = hn::Mul(a.part[i], b.part[i]);
    return product;
}

// Sums over the columns of a block, or with factors of them: six numbers. What is behind them may
// be another thread's.
template <class Factor>
HWY_INLINE void add_columns(const float* block, Factor factor, float* six) {
    const D4 d4;
    V4 low = hn::Zero(d4), high = low;
    for (size_t c = 0; c < 6; ++c) {
        low = hn::MulAdd(hn::LoadU(d4, block + 6 * c), factor(c), low);
        high = hn::MulAdd(hn::LoadU(d4, block + 6 * c + 4), factor(c), high);
    }
    hn::StoreU(low, d4, six);
    hn::StoreU(hn::LowerHalf(D2(), high), D2(), six + 4);
}

// residual -> conditioned by the inverse diagonal, and the same down the columns of blocks.
HWY_INLINE void precondition(LmWorkspace& work, const LmPart& part) {
    const D d;
    const D4 d4;
    for (size_t i = part.first; i < part.last; ++i) {
        const float* x = &work.residual[6 * i];
        float* six = &work.conditioned[6 * i];
        add_columns(
            &work.inverse[i * kBlockFloats], [&](size_t c) HWY_ATTR { return hn::Set(d4, x[c]); },
            six);
        // What is written beyond a column the next one overwrites; beyond the last it is padding.
        float* block = &work.spread[i * kBlockFloats];
        for (size_t c = 0; c < 6; ++c)
            for (size_t k = 0; k < 8; k += hn::Lanes(d))
                hn::StoreU(hn::Set(d, six[c]), d, block + 6 * c + k);
    }
}

// Marquardt's damping. What has no weight at all gets one, and stays where it is.
void damp(const SolveTask& task, const LmPart& part) {
    LmWorkspace& work = *task.workspace;
    for (size_t i = part.first; i < part.last; ++i) {
        const float* block = &task.system->diagonal[i * kBlockFloats];
        float* damped = &work.damped[i * kBlockFloats];
        std::copy(block, block + kBlockFloats, damped);
        float trace = 0;
        for (int r = 0; r < 6; ++r) trace += block[7 * r];
        const float minimum = trace > 0 ? float(kMinDiagonal) * trace : 1.0f;
        for (int r = 0; r < 6; ++r) damped[7 * r] = block[7 * r] * (1 + task.lambda) + minimum;
    }
}

// Inverses of the damped diagonal blocks by Cholesky, a block in each lane. Pivots that vanish in
// single precision are raised.
void invert_diagonal(LmWorkspace& work, const LmPart& part) {
    const D d;
    const hn::Rebind<int32_t, D> di;
    const size_t lanes = hn::Lanes(d), rows = part.last;
    alignas(64) float out[kBlockFloats * 8];
    for (size_t i = part.first; i < rows; i += lanes) {
        const auto index =
            hn::Mul(hn::Min(hn::Iota(di, int32_t(i)), hn::Set(di, int32_t(rows) - 1)),
                    hn::Set(di, int32_t(kBlockFloats)));
        V factor[6][6], own[6][6];  // block = factor factor^T; own = factor^-1
        for (size_t c = 0; c < 6; ++c)
            for (size_t r = c; r < 6; ++r) {
                V value = hn::GatherIndex(d, work.damped.data() + 6 * c + r, index);
                const V minimum = hn::Mul(value, hn::Set(d, kMinPivot));
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

// Stores the first entries of the columns as one row, their second ones as another.
HWY_INLINE void store_rows(V4 a, V4 b, V4 c, V4 d, float* first, float* second) {
    const auto ab = hn::InterleaveLower(D4(), a, b), cd = hn::InterleaveLower(D4(), c, d);
    hn::StoreU(hn::ConcatLowerLower(D4(), cd, ab), D4(), first);
    hn::StoreU(hn::ConcatUpperUpper(D4(), cd, ab), D4(), second);
}
HWY_INLINE void store_rows(V4 a, V4 b, float* first, float* second) {
    const auto ab = hn::InterleaveLower(D4(), a, b);
    hn::StoreU(hn::LowerHalf(D2(), ab), D2(), first);
    hn::StoreU(hn::UpperHalf(D2(), ab), D2(), second);
}
// Transposes a block, whose columns have six entries; two more are loaded behind the last one.
HWY_INLINE void transpose(const float* from, float* to) {
    for (size_t r = 0; r < 6; r += 2) {
        V4 column[6];  // two entries
        for (size_t c = 0; c < 6; ++c) column[c] = hn::LoadU(D4(), from + 6 * c + r);
        store_rows(column[0], column[1], column[2], column[3], to + 6 * r, to + 6 * r + 6);
        store_rows(column[4], column[5], to + 6 * r + 4, to + 6 * r + 10);
    }
}

// The blocks above the diagonal, of a part's rows.
void transpose(const SolveTask& task, const LmPart& part) {
    const UpperPattern& upper = task.workspace->upper;
    for (size_t b = upper.start[part.first]; b < upper.start[part.last]; ++b)
        transpose(&task.system->lower[upper.transposed[b] * kBlockFloats],
                  &task.workspace->above[b * kBlockFloats]);
}

// Conditions a part of the system, and starts from x = 0. Returns the part's share of residual
// times conditioned residual.
double Start(const SolveTask& task, size_t index) {
    LmWorkspace& work = *task.workspace;
    const LmPart& part = work.parts[index];
    damp(task, part);
    invert_diagonal(work, part);
    if (task.iterations > 0) transpose(task, part);
    for (size_t i = 6 * part.first; i < 6 * part.last; ++i)
        work.residual[i] = -task.system->gradient[i];
    precondition(work, part);
    const size_t first = part.first_number(), last = part.last_number();
    for (auto* vector : {&work.x, &work.direction, &work.image})
        std::fill(vector->data() + first, vector->data() + last, 0.0f);
    return product(work.residual.data(), work.conditioned.data(), first, last);
}

// direction = conditioned + beta direction, and its image by the matrix likewise, in a part's rows.
// Entry by entry a block multiplies its column's numbers, spread; entries are added up in the end.
// Returns the part's share of direction times image.
double Multiply(const SolveTask& task, size_t index, float beta) {
    LmWorkspace& work = *task.workspace;
    const LmPart& part = work.parts[index];
    const auto add_blocks = [&work](const float* blocks, const int32_t* columns, size_t first,
                                    size_t last, Block sum) HWY_ATTR {
        for (size_t b = first; b < last; ++b)
            sum = multiply_add(load(blocks + b * kBlockFloats),
                               load(&work.spread[size_t(columns[b]) * kBlockFloats]), sum);
        return sum;
    };
    const LowerPattern& lower = *task.pattern;
    const UpperPattern& upper = work.upper;
    for (size_t i = part.first; i < part.last; ++i) {
        Block sum =
            multiply(load(&work.damped[i * kBlockFloats]), load(&work.spread[i * kBlockFloats]));
        sum = add_blocks(task.system->lower.data(), lower.column.data(), lower.start[i],
                         lower.start[i + 1], sum);
        sum = add_blocks(work.above.data(), upper.column.data(), upper.start[i], upper.start[i + 1],
                         sum);
        store(sum, &work.products[i * kBlockFloats]);
    }
    const V4 one = hn::Set(D4(), 1.0f);
    for (size_t i = part.first; i < part.last; ++i)
        add_columns(
            &work.products[i * kBlockFloats], [one](size_t) HWY_ATTR { return one; },
            &work.conditioned_image[6 * i]);
    const size_t first = part.first_number(), last = part.last_number(), count = last - first;
    add_to_scaled(&work.conditioned[first], beta, &work.direction[first], count);
    add_to_scaled(&work.conditioned_image[first], beta, &work.image[first], count);
    return product(work.direction.data(), work.image.data(), first, last);
}

// A step of length alpha in a part's rows. Returns the part's share of residual times conditioned
// residual.
double Step(const SolveTask& task, size_t index, float alpha) {
    LmWorkspace& work = *task.workspace;
    const LmPart& part = work.parts[index];
    const size_t first = part.first_number(), last = part.last_number(), count = last - first;
    add_scaled(alpha, &work.direction[first], &work.x[first], count);
    add_scaled(-alpha, &work.image[first], &work.residual[first], count);
    precondition(work, part);
    return product(work.residual.data(), work.conditioned.data(), first, last);
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace defrec::cpu {

HWY_EXPORT(Start);
HWY_EXPORT(Multiply);
HWY_EXPORT(Step);

namespace {

// body(part) for all parts on the host's threads; the sum of what they return, in their order.
template <class Body>
double sum_parts(const SolveTask& task, Body&& body) {
    std::span<double> sums = task.workspace->sums;
    task.host->parallel_for(sums.size(), [&](size_t part) { sums[part] = body(part); });
    return std::accumulate(sums.begin(), sums.end(), 0.0);
}

void conjugate_gradients(const SolveTask& task, double rho) {
    const double enough = kConjugateTolerance * kConjugateTolerance * rho;
    double beta = 0;
    for (uint32_t i = 0; i < task.iterations && rho > enough; ++i) {
        const double curvature = sum_parts(task, [&](size_t part) {
            return HWY_DYNAMIC_DISPATCH(Multiply)(task, part, float(beta));
        });
        if (!(curvature > 0)) break;
        const double next = sum_parts(task, [&](size_t part) {
            return HWY_DYNAMIC_DISPATCH(Step)(task, part, float(rho / curvature));
        });
        beta = next / rho;
        rho = next;
    }
}

}  // namespace

bool solve_system(const SolveTask& task) {
    LmWorkspace& work = *task.workspace;
    const double rho =
        sum_parts(task, [&](size_t part) { return HWY_DYNAMIC_DISPATCH(Start)(task, part); });
    if (!std::isfinite(rho)) return false;
    if (task.iterations > 0)
        conjugate_gradients(task, rho);
    else
        std::copy(work.conditioned.begin(), work.conditioned.end(), work.x.begin());
    return std::all_of(work.x.begin(), work.x.end(), [](float x) { return std::isfinite(x); });
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

UpperPattern::UpperPattern(const LowerPattern& lower, const Host& host)
    : start(lower.rows() + 1, HostAllocator<uint32_t>(host)),
      column(lower.blocks(), HostAllocator<int32_t>(host)),
      transposed(lower.blocks(), HostAllocator<uint32_t>(host)) {
    for (const int32_t row : lower.column) ++start[size_t(row) + 1];
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<uint32_t> next(start.begin(), start.end() - 1);
    for (size_t i = 0; i < lower.rows(); ++i)
        for (uint32_t b = lower.start[i]; b < lower.start[i + 1]; ++b) {
            const uint32_t at = next[size_t(lower.column[b])]++;
            column[at] = int32_t(i);
            transposed[at] = b;
        }
}

LmWorkspace::LmWorkspace(const LowerPattern& pattern, const Host& host)
    : parts(HostAllocator<LmPart>(host)),
      upper(pattern, host),
      sums(HostAllocator<double>(host)),
      above(pattern.blocks() * kBlockFloats, HostAllocator<float>(host)),
      damped(pattern.rows() * kBlockFloats, HostAllocator<float>(host)),
      inverse(damped),
      spread(damped),
      products(damped),
      x((pattern.rows() * 6 + 15) / 16 * 16, HostAllocator<float>(host)),
      residual(x),
      conditioned(x),
      conditioned_image(x),
      direction(x),
      image(x) {
    const size_t rows = pattern.rows(),
                 count = std::bit_floor(std::clamp<size_t>(rows / kMinPartRows, 1, kMaxParts)),
                 each = (rows + kPartStep * count - 1) / (kPartStep * count) * kPartStep;
    for (size_t first = 0; first < rows; first += each)
        parts.push_back({first, std::min(rows, first + each)});
    sums.resize(parts.size());
}

}  // namespace defrec::cpu
#endif
