// The system's solution by conjugate gradients. Conditioned on both sides by the factors of its damped diagonal blocks the system has ones
// on the diagonal, and the steps are those of the preconditioned method (docs/stages/lm.md). One barrier of the grid for each step: blocks
// pass on their rows of the product, and each does the rest for all rows by itself.
#pragma once
#include "backends/cuda/lm_memory.cuh"
#include "backends/cuda/lm_sums.cuh"
#include "backends/shared/levenberg_marquardt.hpp"

namespace defrec::cuda {
namespace {

// The other half of condition_rows of lm_linearise.cuh: places times their columns' factors, transposed.
template <class Mode>
__device__ __forceinline__ void condition_columns(const LmView& view, const LmMemory<Mode>& memory, const LmShare& share, uint32_t copy) {
    const float* factors = view.exchange.factors + size_t{copy} * kFactor * view.p.nodes;
    const uint32_t count = 6 * (share.last_place - share.first_place);
    for (uint32_t u = threadIdx.x; u < count; u += kLmThreads) {
        const float* factor = factors + view.surface.places[share.first_place + u / 6].column;
        float* row = memory.matrix + 36 * (u / 6) + 6 * (u % 6);
        float before[6];
        for (uint32_t c = 0; c < 6; ++c) before[c] = row[c];
        for (uint32_t r = 0, at = 0; r < 6; ++r) {
            float value = 0;
            for (uint32_t c = 0; c <= r; ++c, ++at) value = fmaf(factor[size_t{at} * view.p.nodes], before[c], value);
            row[r] = value;
        }
    }
}

template <class Mode>
__device__ __forceinline__ uint32_t column_of(const LmView& view, const LmMemory<Mode>& memory, const LmShare& share, uint32_t place) {
    if constexpr (Mode::kMatrix) return memory.columns[place];
    return view.surface.places[share.first_place + place].column;
}

// The block's rows of matrix times direction.
template <class Mode>
__device__ __forceinline__ void multiply(const LmView& view, const LmMemory<Mode>& memory, const LmShare& share, float* product) {
    constexpr uint32_t kSplit = 8, kRows = kLmThreads / kSplit;  // threads that share a row; rows at a time
    const uint32_t split = threadIdx.x % kSplit, count = 6 * (share.last_node - share.first_node);
    for (uint32_t first = 0; first < count; first += kRows) {
        const uint32_t u = first + threadIdx.x / kSplit, node = share.first_node + u / 6;
        float sum = 0;
        if (u < count) {
            const uint32_t end = view.surface.row_places[node + 1] - share.first_place;
            for (uint32_t place = view.surface.row_places[node] - share.first_place + split; place < end; place += kSplit) {
                const auto* row = reinterpret_cast<const float2*>(memory.matrix + 36 * size_t{place} + 6 * (u % 6));
                const auto* x = reinterpret_cast<const float2*>(memory.direction + 6 * size_t{column_of(view, memory, share, place)});
                for (uint32_t i = 0; i < 3; ++i) sum = fmaf(row[i].y, x[i].y, fmaf(row[i].x, x[i].x, sum));
            }
        }
        for (uint32_t apart = kSplit / 2; apart > 0; apart /= 2) sum += __shfl_xor_sync(kAllLanes, sum, static_cast<int>(apart));
        if (split == 0 && u < count) product[6 * share.first_node + u] = sum + memory.direction[6 * share.first_node + u];
    }
}

enum LmProductOf : uint32_t { kDirectionProduct, kResidualProduct, kProductProduct, kResidualResidual, kProducts };

// Of the vectors that the block updates; where those are not all of them, of all blocks.
template <class Mode>
__device__ __forceinline__ void dot_products(const LmView& view, const LmMemory<Mode>& memory, const float* product, uint32_t copy,
                                             float (&dots)[kProducts]) {
    __shared__ float warps[kLmWarps][kProducts];
    const auto sum_own = [&] {
        for (float& dot : dots) dot = 0;
        for (uint32_t i = 6 * memory.first_node + threadIdx.x; i < 6 * memory.last_node; i += kLmThreads) {
            const float q = product[i], r = memory.residual[i], p = memory.direction[i];
            dots[kDirectionProduct] = fmaf(p, q, dots[kDirectionProduct]);
            dots[kResidualProduct] = fmaf(r, q, dots[kResidualProduct]);
            dots[kProductProduct] = fmaf(q, q, dots[kProductProduct]);
            dots[kResidualResidual] = fmaf(r, r, dots[kResidualResidual]);
        }
        block_sums(dots, warps);
    };
    if constexpr (Mode::kReplicated) {
        sync_grid();
        sum_own();
    } else {
        float* sums = view.exchange.sums + size_t{copy} * gridDim.x * kSums;
        __syncthreads();
        sum_own();
        if (threadIdx.x < kProducts) sums[blockIdx.x * kProducts + threadIdx.x] = dots[threadIdx.x];
        sync_grid();
        for (float& dot : dots) dot = 0;
        for (uint32_t block = threadIdx.x; block < gridDim.x; block += kLmThreads)
            for (uint32_t i = 0; i < kProducts; ++i) dots[i] += sums[block * kProducts + i];
        block_sums(dots, warps);
    }
}

// The solution, conditioned, from the system in the given copy.
template <class Mode>
__device__ __forceinline__ void solve(const LmView& view, const LmMemory<Mode>& memory, const LmShare& share, uint32_t copy) {
    const float* start = view.exchange.starts + size_t{copy} * 6 * view.p.nodes;
    const uint32_t first = 6 * memory.first_node + threadIdx.x, last = 6 * memory.last_node;
    const bool coupled = view.p.steps > 0;
    for (uint32_t i = first; i < last; i += kLmThreads) {
        const float value = start[i];
        memory.residual[i] = memory.direction[i] = value;
        memory.solution[i] = coupled ? 0.0f : value;
    }
    if (coupled) condition_columns(view, memory, share, copy);
    sync_nodes<Mode>();

    float enough = 0;
    for (uint32_t step = 0; step < view.p.steps; ++step) {
        float* product = view.exchange.products + size_t{step % 2} * 6 * view.p.nodes;
        multiply(view, memory, share, product);
        float dots[kProducts];
        dot_products(view, memory, product, step % 2, dots);
        const float rho = dots[kResidualResidual], curvature = dots[kDirectionProduct];
        if (step == 0) enough = float(kConjugateTolerance * kConjugateTolerance) * rho;
        if (!(rho > enough) || !(curvature > 0)) break;
        const float alpha = rho / curvature;
        const float next = fmaxf(fmaf(alpha, fmaf(alpha, dots[kProductProduct], -2 * dots[kResidualProduct]), rho), 0.0f);
        const float beta = next / rho;
        for (uint32_t i = first; i < last; i += kLmThreads) {
            const float direction = memory.direction[i], residual = fmaf(-alpha, product[i], memory.residual[i]);
            memory.solution[i] = fmaf(alpha, direction, memory.solution[i]);
            memory.residual[i] = residual;
            memory.direction[i] = fmaf(beta, direction, residual);
        }
        sync_nodes<Mode>();
        if (!(next > enough)) break;
    }
}

}  // namespace
}  // namespace defrec::cuda
