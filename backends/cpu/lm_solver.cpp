// Solves the system of stage lm: control points by themselves (Cholesky of their 6x6 blocks), or
// all of them by conjugate gradients that those blocks precondition. The rows are cut into parts by
// the pattern alone; each is one thread's at a time, and sums are added in the order of the parts.
#include <algorithm>
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
HWY_INLINE void add(const float* x, float* y, size_t count) {
    const D d;
    for (size_t i = 0; i < count; i += hn::Lanes(d))
        hn::Store(hn::Add(hn::Load(d, x + i), hn::Load(d, y + i)), d, y + i);
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

// Eight numbers of which the first six are a row's; what lies beyond is overwritten, or padding.
HWY_INLINE void store_eight(const float* from, float* to) {
    const D d;
    for (size_t i = 0; i < 8; i += hn::Lanes(d)) hn::StoreU(hn::LoadU(d, from + i), d, to + i);
}
HWY_INLINE Block multiply(const Block& a, const Block& b) {
    Block product;
    for (size_t i = 0; i < Block::kParts; ++i) product.part[i] = hn::Mul(a.part[i], b.part[i]);
    return product;
}

// Each of a row's six numbers down a column of a block.
HWY_INLINE void spread(const float* x, float* block) {
    const D d;
    for (size_t c = 0; c < 6; ++c)
        for (size_t i = 0; i < 8; i += hn::Lanes(d))
            hn::StoreU(hn::Set(d, x[c]), d, block + 6 * c + i);
}
// The six numbers as every column. twice: them, and them again.
HWY_INLINE Block repeat(const float* twice) {
    Block b;
    for (size_t i = 0; i < Block::kParts; ++i)
        b.part[i] = hn::LoadU(D(), twice + i * hn::Lanes(D()) % 6);
    return b;
}
// Sums over the columns of a block, and over its rows.
HWY_INLINE void add_columns(const float* block, float* six) {
    for (size_t r = 0; r < 6; ++r)
        six[r] = ((block[r] + block[6 + r]) + (block[12 + r] + block[18 + r])) +
                 (block[24 + r] + block[30 + r]);
}
HWY_INLINE void add_rows(const float* block, float* six) {
    for (size_t c = 0; c < 6; ++c) {
        const float* t = block + 6 * c;
        six[c] = ((t[0] + t[1]) + (t[2] + t[3])) + (t[4] + t[5]);
    }
}

// residual -> conditioned by the inverse diagonal.
HWY_INLINE void precondition(LmWorkspace& work, const LmPart& part) {
    const hn::FixedTag<float, 4> d4;
    for (size_t i = part.first; i < part.last; ++i) {
        const float* m = &work.inverse[i * kBlockFloats];
        const float* x = &work.residual[6 * i];
        auto low = hn::Zero(d4), high = low;
        for (size_t c = 0; c < 6; ++c) {
            const auto factor = hn::Set(d4, x[c]);
            low = hn::MulAdd(hn::LoadU(d4, m + 6 * c), factor, low);
            high = hn::MulAdd(hn::LoadU(d4, m + 6 * c + 4), factor, high);
        }
        hn::StoreU(low, d4, &work.conditioned[6 * i]);
        const hn::FixedTag<float, 2> d2;  // the next row may be another thread's
        hn::StoreU(hn::LowerHalf(d2, high), d2, &work.conditioned[6 * i + 4]);
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

// Conditions a part of the system, and starts from x = 0. Returns the part's share of residual
// times conditioned residual.
double Start(const SolveTask& task, size_t index) {
    LmWorkspace& work = *task.workspace;
    const LmPart& part = work.cut.parts[index];
    damp(task, part);
    invert_diagonal(work, part);
    for (size_t i = 6 * part.first; i < 6 * part.last; ++i)
        work.residual[i] = -task.system->gradient[i];
    precondition(work, part);
    const size_t first = part.first_number(), last = part.last_number();
    std::fill(work.x.data() + first, work.x.data() + last, 0.0f);
    for (auto& direction : work.direction)
        std::fill(direction.data() + first, direction.data() + last, 0.0f);
    return product(work.residual.data(), work.conditioned.data(), first, last);
}

// direction = conditioned + beta direction, and the matrix times it, as far as a part's rows of the
// lower half give it: for the rows themselves, and, by the transposed blocks, for rows before them.
// Entry by entry a block multiplies its column's direction, spread, for its own row's result, and
// its row's direction, repeated, for the result of the row that its transpose stands in; the
// entries are added up in the end. Returns the part's share of direction times product.
double Multiply(const SolveTask& task, size_t index, float beta, size_t old) {
    const D d;
    LmWorkspace& work = *task.workspace;
    const LmPart& part = work.cut.parts[index];
    const LowerPattern& pattern = *task.pattern;
    const size_t before = kStripRows * part.strips(), own = 6 * before;
    float* direction = &work.part_direction[part.offset * 6];
    float* spreads = &work.spread[part.offset * kBlockFloats];
    float* transposed = &work.transposed[part.offset * kBlockFloats];
    float* direct = &work.direct[part.first * kBlockFloats];
    float* twice = &work.twice[part.first * 16];
    float* result = &work.part_product[part.offset * 6];

    const size_t rows = part.last - part.first, places = before + rows,
                 own_numbers = part.last_number() - part.first_number();
    const auto take_direction = [&](size_t from, size_t count, float* to) {
        const V factor = hn::Set(d, beta);
        for (size_t i = 0; i < count; i += hn::Lanes(d))
            hn::Store(hn::MulAdd(factor, hn::Load(d, &work.direction[old][from + i]),
                                 hn::Load(d, &work.conditioned[from + i])),
                      d, to + i);
    };
    for (size_t s = 0; s < part.strips(); ++s)
        take_direction(6 * size_t(work.cut.strips[part.first_strip + s]), kStripNumbers,
                       direction + s * kStripNumbers);
    take_direction(part.first_number(), own_numbers, direction + own);
    std::copy_n(direction + own, own_numbers, &work.direction[1 - old][part.first_number()]);
    for (size_t j = 0; j < places; ++j) spread(direction + 6 * j, spreads + j * kBlockFloats);
    for (size_t i = 0; i < rows; ++i) {
        store_eight(direction + own + 6 * i, twice + 16 * i);
        store_eight(direction + own + 6 * i, twice + 16 * i + 6);
    }
    std::fill(transposed, transposed + places * kBlockFloats, 0.0f);
    for (size_t i = part.first; i < part.last; ++i) {
        const Block across = repeat(twice + 16 * (i - part.first));
        Block sum = multiply(load(&work.damped[i * kBlockFloats]),
                             load(spreads + (before + i - part.first) * kBlockFloats));
        for (size_t b = pattern.start[i]; b < pattern.start[i + 1]; ++b) {
            const size_t j = size_t(work.cut.places[b]) * kBlockFloats;
            const Block block = load(&task.system->lower[b * kBlockFloats]);
            sum = multiply_add(block, load(spreads + j), sum);
            store(multiply_add(block, across, load(transposed + j)), transposed + j);
        }
        store(sum, direct + (i - part.first) * kBlockFloats);
    }
    for (size_t j = 0; j < places; ++j) add_rows(transposed + j * kBlockFloats, result + 6 * j);
    for (size_t i = 0; i < rows; ++i) {
        float six[6];
        add_columns(direct + i * kBlockFloats, six);
        for (size_t r = 0; r < 6; ++r) result[own + 6 * i + r] += six[r];
    }
    return product(direction, result, 0, own + own_numbers);
}

// A step of length alpha in a part's rows. Returns the part's share of residual times conditioned
// residual.
double Step(const SolveTask& task, size_t index, float alpha, size_t now) {
    LmWorkspace& work = *task.workspace;
    const LmParts& cut = work.cut;
    const LmPart& part = cut.parts[index];
    const size_t first = part.first_number(), last = part.last_number(), count = last - first;
    float* product_here = &work.part_product[part.offset * 6 + part.strips() * kStripNumbers];
    for (size_t k = index + 1; k < cut.parts.size(); ++k) {
        const LmPart& other = cut.parts[k];
        const auto strips = cut.strips.begin() + std::ptrdiff_t(other.first_strip),
                   end = cut.strips.begin() + std::ptrdiff_t(other.last_strip);
        for (auto s = std::lower_bound(strips, end, part.first); s != end && *s < part.last; ++s)
            add(&work.part_product[other.offset * 6 + size_t(s - strips) * kStripNumbers],
                product_here + 6 * size_t(*s) - first, kStripNumbers);
    }
    add_scaled(alpha, &work.direction[now][first], &work.x[first], count);
    add_scaled(-alpha, product_here, &work.residual[first], count);
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
        const size_t old = i % 2;
        const double curvature = sum_parts(task, [&](size_t part) {
            return HWY_DYNAMIC_DISPATCH(Multiply)(task, part, float(beta), old);
        });
        if (!(curvature > 0)) break;
        const double next = sum_parts(task, [&](size_t part) {
            return HWY_DYNAMIC_DISPATCH(Step)(task, part, float(rho / curvature), 1 - old);
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

namespace {

// Places that a part's arrays have room for: store_eight reads two numbers behind the last row's,
// and those behind belong to another thread.
size_t room_of(const LmPart& part) {
    const size_t numbers = part.strips() * kStripNumbers + part.last_number() - part.first_number();
    return (numbers + 2 + kStripNumbers - 1) / kStripNumbers * kStripRows;
}

}  // namespace

LmParts::LmParts(const LowerPattern& pattern, const Host& host)
    : parts(HostAllocator<LmPart>(host)),
      strips(HostAllocator<uint32_t>(host)),
      places(pattern.blocks(), HostAllocator<uint32_t>(host)) {
    const size_t rows = pattern.rows(),
                 count = std::clamp<size_t>(rows / kMinPartRows, 1, kMaxParts),
                 each = (rows + kStripRows * count - 1) / (kStripRows * count) * kStripRows;
    size_t offset = 0;
    for (size_t first = 0; first < rows; first += each) {
        LmPart& part = parts.emplace_back();
        part = {first, std::min(rows, first + each), strips.size(), strips.size(), offset};
        const auto first_block = pattern.start[first], last_block = pattern.start[part.last];
        for (uint32_t b = first_block; b < last_block; ++b)
            if (const auto column = size_t(pattern.column[b]); column < first)
                strips.push_back(uint32_t(column / kStripRows * kStripRows));
        const auto own = strips.begin() + std::ptrdiff_t(part.first_strip);
        std::sort(own, strips.end());
        strips.erase(std::unique(own, strips.end()), strips.end());
        part.last_strip = strips.size();
        for (uint32_t b = first_block; b < last_block; ++b) {
            const auto column = size_t(pattern.column[b]);
            if (column >= first) {
                places[b] = uint32_t(kStripRows * part.strips() + column - first);
                continue;
            }
            const auto strip = std::upper_bound(own, strips.end(), column) - 1;
            places[b] = uint32_t(kStripRows * size_t(strip - own) + column - *strip);
        }
        offset += room_of(part);
    }
}

LmWorkspace::LmWorkspace(const LowerPattern& pattern, const Host& host)
    : cut(pattern, host),
      sums(cut.parts.size(), HostAllocator<double>(host)),
      damped(pattern.rows() * kBlockFloats, HostAllocator<float>(host)),
      inverse(damped),
      direct(damped),
      twice(pattern.rows() * 16, HostAllocator<float>(host)),
      x((pattern.rows() * 6 + 15) / 16 * 16, HostAllocator<float>(host)),
      residual(x),
      conditioned(x),
      direction{x, x},
      spread(HostAllocator<float>(host)),
      transposed(HostAllocator<float>(host)),
      part_direction(HostAllocator<float>(host)),
      part_product(HostAllocator<float>(host)) {
    size_t places = 0;
    if (!cut.parts.empty()) places = cut.parts.back().offset + room_of(cut.parts.back());
    spread.resize(places * kBlockFloats);
    transposed.resize(spread.size());
    part_direction.resize(places * 6 + 16);
    part_product.resize(part_direction.size());
}

}  // namespace defrec::cpu
#endif
