// The system's solution by conjugate gradients. Conditioned on both sides by the factors of its
// damped diagonal blocks the system has ones on the diagonal, and the steps are those of the
// preconditioned method (docs/stages/lm.md). One barrier of the grid for each step: blocks pass on
// their rows of the product and their parts of four dot products, and each updates the vectors of
// all control points that it knows.
#pragma once
#include "backends/cuda/lm_memory.cuh"
#include "backends/cuda/lm_sums.cuh"
#include "backends/shared/levenberg_marquardt.hpp"

namespace defrec::cuda {
namespace {

// The other half of condition_rows of lm_linearise.cuh: places times their columns' factors,
// transposed.
__device__ __forceinline__ void condition_columns(const LmView& view, const LmMemory& memory,
                                                  const LmShare& share, uint32_t copy) {
    const float* factors = view.exchange.factors + size_t{copy} * kFactor * view.p.nodes;
    const uint32_t count = 6 * (share.last_place - share.first_place);
    for (uint32_t u = threadIdx.x; u < count; u += kLmThreads) {
        const float* factor = factors + memory.known[memory.columns[u / 6]];
        float* row = memory.matrix + 36 * size_t{u / 6} + 6 * (u % 6);
        float before[6];
        for (uint32_t c = 0; c < 6; ++c) before[c] = row[c];
        for (uint32_t r = 0, at = 0; r < 6; ++r) {
            float value = 0;
            for (uint32_t c = 0; c <= r; ++c, ++at)
                value = fmaf(factor[size_t{at} * view.p.nodes], before[c], value);
            row[r] = value;
        }
    }
}

enum LmProductOf : uint32_t {
    kDirectionProduct,
    kResidualProduct,
    kProductProduct,
    kResidualResidual,
    kProducts
};

// The block's rows of matrix times direction, and its part of the dot products.
__device__ __forceinline__ void multiply(const LmMemory& memory, const LmShare& share,
                                         float* product, float4* dots) {
    constexpr uint32_t kSplit = 8,
                       kRows = kLmThreads / kSplit;  // threads that share a row; rows at a time
    __shared__ float warps[kLmWarps][kProducts];
    const uint32_t split = threadIdx.x % kSplit, count = 6 * (share.last_node - share.first_node);
    float parts[kProducts] = {};
    for (uint32_t first = 0; first < count; first += kRows) {
        const uint32_t u = first + threadIdx.x / kSplit;
        float sum = 0;
        if (u < count) {
            const uint32_t end = memory.row_places[u / 6 + 1];
            for (uint32_t place = memory.row_places[u / 6] + split; place < end; place += kSplit) {
                const auto* row = reinterpret_cast<const float2*>(memory.matrix +
                                                                  36 * size_t{place} + 6 * (u % 6));
                const auto* x = reinterpret_cast<const float2*>(memory.direction +
                                                                6 * size_t{memory.columns[place]});
                for (uint32_t i = 0; i < 3; ++i)
                    sum = fmaf(row[i].y, x[i].y, fmaf(row[i].x, x[i].x, sum));
            }
        }
        for (uint32_t apart = kSplit / 2; apart > 0; apart /= 2)
            sum += __shfl_xor_sync(kAllLanes, sum, static_cast<int>(apart));
        if (split != 0 || u >= count) continue;
        const float p = memory.direction[u], r = memory.residual[u], q = sum + p;
        product[6 * share.first_node + u] = q;
        parts[kDirectionProduct] = fmaf(p, q, parts[kDirectionProduct]);
        parts[kResidualProduct] = fmaf(r, q, parts[kResidualProduct]);
        parts[kProductProduct] = fmaf(q, q, parts[kProductProduct]);
        parts[kResidualResidual] = fmaf(r, r, parts[kResidualResidual]);
    }
    block_sums(parts, warps);
    if (threadIdx.x == 0) dots[blockIdx.x] = make_float4(parts[0], parts[1], parts[2], parts[3]);
}

// Entry i of a vector of known control points in one of all.
__device__ __forceinline__ uint32_t place_of(const LmMemory& memory, uint32_t i) {
    return 6 * memory.known[i / 6] + i % 6;
}

// The solution, conditioned, from the system in the given copy.
__device__ __forceinline__ void solve(const LmView& view, const LmMemory& memory,
                                      const LmShare& share, uint32_t copy, GridBarrier& barrier) {
    constexpr uint32_t kAhead = 2;
    __shared__ float warps[kLmWarps][kProducts];
    const float* start = view.exchange.starts + size_t{copy} * 6 * view.p.nodes;
    const uint32_t count = 6 * memory.count;
    const bool coupled = view.p.steps > 0;
    for (uint32_t i = threadIdx.x; i < count; i += kLmThreads) {
        const float value = start[place_of(memory, i)];
        memory.residual[i] = memory.direction[i] = value;
        memory.solution[i] = coupled ? 0.0f : value;
    }
    if (coupled) condition_columns(view, memory, share, copy);
    __syncthreads();

    float enough = 0;
    for (uint32_t step = 0; step < view.p.steps; ++step) {
        float* product = view.exchange.products + size_t{step % 2} * 6 * view.p.nodes;
        float4* parts = view.exchange.dots + step % 2 * gridDim.x;
        multiply(memory, share, product, parts);
        barrier.wait();
        float ahead[kAhead];  // loaded before the sums are known
        for (uint32_t k = 0; k < kAhead; ++k) {
            const uint32_t i = threadIdx.x + k * kLmThreads;
            ahead[k] = i < count ? product[place_of(memory, i)] : 0.0f;
        }
        float dots[kProducts] = {};
        for (uint32_t block = threadIdx.x; block < gridDim.x; block += kLmThreads) {
            const float4 part = parts[block];
            dots[0] += part.x;
            dots[1] += part.y;
            dots[2] += part.z;
            dots[3] += part.w;
        }
        block_sums(dots, warps);
        const float rho = dots[kResidualResidual], curvature = dots[kDirectionProduct];
        if (step == 0) enough = float(kConjugateTolerance * kConjugateTolerance) * rho;
        if (!(rho > enough) || !(curvature > 0)) break;
        const float alpha = rho / curvature;
        const float next =
            fmaxf(fmaf(alpha, fmaf(alpha, dots[kProductProduct], -2 * dots[kResidualProduct]), rho),
                  0.0f);
        const float beta = next / rho;
        const auto update = [&](uint32_t i, float q) {
            const float direction = memory.direction[i],
                        residual = fmaf(-alpha, q, memory.residual[i]);
            memory.solution[i] = fmaf(alpha, direction, memory.solution[i]);
            memory.residual[i] = residual;
            memory.direction[i] = fmaf(beta, direction, residual);
        };
        for (uint32_t k = 0; k < kAhead; ++k)
            if (const uint32_t i = threadIdx.x + k * kLmThreads; i < count) update(i, ahead[k]);
        for (uint32_t i = threadIdx.x + kAhead * kLmThreads; i < count; i += kLmThreads)
            update(i, product[place_of(memory, i)]);
        __syncthreads();
        if (!(next > enough)) break;
    }
}

}  // namespace
}  // namespace defrec::cuda
