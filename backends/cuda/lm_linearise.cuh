// The cost by the poses that memory holds, and the system there: each block its own rows.
#pragma once
#include "backends/cuda/lm_residuals.cuh"
#include "backends/shared/levenberg_marquardt.hpp"

namespace defrec::cuda {
namespace {

// Entry of a lower triangle that is kept row by row, c <= r.
__host__ __device__ constexpr uint32_t triangle(uint32_t r, uint32_t c) {
    return r * (r + 1) / 2 + c;
}

constexpr uint32_t kGradientColumn = 6, kDataColumn = 7;  // of kLmColumns, after a block's six

// What a term adds to a column of a block: (arm x v; v) with v of the row's control point.
__device__ __forceinline__ void add_term(const float4* record, uint32_t k, uint32_t l,
                                         uint32_t column, float (&total)[6]) {
    const float4 row = record[kArms + k];
    const float4 v = record[column < 3 ? kTurns + 3 * l + column : kShifts + column - 3];
    const float weight = column < kGradientColumn ? record[kArms + l].w : (k == l ? 1.0f : 0.0f);
    const float x = weight * v.x, y = weight * v.y, z = weight * v.z;
    total[0] = fmaf(row.y, z, fmaf(-row.z, y, total[0]));
    total[1] = fmaf(row.z, x, fmaf(-row.x, z, total[1]));
    total[2] = fmaf(row.x, y, fmaf(-row.y, x, total[2]));
    total[3] = fmaf(row.w, x, total[3]);
    total[4] = fmaf(row.w, y, total[4]);
    total[5] = fmaf(row.w, z, total[5]);
}

// Where entry r of a column is in the record of a connection.
__device__ __forceinline__ uint32_t connection_component(uint32_t r, uint32_t column) {
    if (column == kGradientColumn) return kGradient + r;
    const uint32_t a = r % 3, b = column % 3, low = min(a, b);
    const uint32_t upper = low * (5 - low) / 2 + max(a, b);  // of a symmetric 3x3
    if (r < 3 && column < 3) return kTurn + upper;
    if (r >= 3 && column >= 3) return kShift + upper;
    return kLever + (r < 3 ? 3 * a + b : 3 * b + a);
}

// The chunk whose sums and terms the block has at hand.
struct LmLoaded {
    uint32_t chunk, sums;
};
__device__ __forceinline__ void load_terms(const LmView& view, const LmMemory& memory,
                                           uint32_t chunk, LmLoaded& loaded) {
    if (loaded.chunk == chunk) return;
    const LmChunk here = view.surface.chunks[chunk];
    loaded = {chunk, here.last_sum - here.first_sum};
    for (uint32_t i = threadIdx.x; i < loaded.sums; i += kLmThreads)
        memory.sums[i] = view.surface.sums[here.first_sum + i];
    for (uint32_t i = threadIdx.x; i < here.last_term - here.first_term; i += kLmThreads)
        memory.terms[i] = view.surface.terms[here.first_term + i];
}

// Which residuals: D, which weights the connections, is known once all items' are.
struct LmKinds {
    bool items, connections;
};

// kLmColumns threads for each block of the matrix.
__device__ __forceinline__ void add_sums(const LmMemory& memory, uint32_t count, LmKinds kinds,
                                         uint32_t rows) {
    const uint32_t column = threadIdx.x % kLmColumns;
    uint32_t component[6];
    for (uint32_t r = 0; r < 6; ++r)
        component[r] = connection_component(r, column) * memory.connection_slots;
    for (uint32_t s = threadIdx.x / kLmColumns; s < count; s += kLmGroups) {
        const LmSum sum = memory.sums[s];
        if (sum.target == kLmNoTarget) break;
        const bool diagonal = sum.target < rows;
        if (!kinds.items && !diagonal) continue;
        float total[6] = {};
        if (kinds.items)
            for (uint32_t at = sum.first_term; at < sum.last_term; ++at) {
                const uint32_t term = memory.terms[at];
                add_term(memory.records + kRecord * (term >> 4), (term >> 2) & 3, term & 3, column,
                         total);
            }
        if (kinds.connections && diagonal && column != kDataColumn)
            for (uint32_t c = sum.first_connection; c < sum.last_connection; ++c)
                for (uint32_t r = 0; r < 6; ++r)
                    total[r] += memory.connection_records[component[r] + c];
        if (diagonal) {
            for (uint32_t r = 0; r < 6; ++r)
                memory.own[kOwn * sum.target + 6 * column + r] += total[r];
        } else if (column < 6) {
            for (uint32_t r = 0; r < 6; ++r)
                memory.matrix[36 * (sum.target - rows) + 6 * r + column] += total[r];
        }
    }
}

// Residuals of those kinds by the poses that memory holds: their sums, and with a system their part
// of it.
__device__ __forceinline__ void add_residuals(const LmView& view, const LmMemory& memory,
                                              const LmShare& share, LmKinds kinds, bool linearise,
                                              LmLoaded& loaded, float (&sums)[kSums]) {
    const uint32_t rows = share.last_node - share.first_node, thread = threadIdx.x,
                   slot = thread - kLmChunk;  // of a connection
    for (uint32_t chunk = 0; chunk < share.chunks; ++chunk) {
        const uint32_t item = share.first_item + chunk * kLmChunk + thread,
                       connection = share.first_connection + chunk * kLmChunk + slot;
        if (linearise) load_terms(view, memory, share.first_chunk + chunk, loaded);
        if (thread < kLmChunk) {
            if (kinds.items && item < share.last_item)
                evaluate_item(view, memory, item, thread, linearise, sums);
        } else if (kinds.connections && connection < share.last_connection) {
            evaluate_connection(view, memory, connection, slot, linearise, sums);
        }
        if (!linearise) continue;
        __syncthreads();
        add_sums(memory, loaded.sums, kinds, rows);
        __syncthreads();
    }
}

__device__ __forceinline__ void clear_system(const LmMemory& memory, const LmShare& share) {
    for (uint32_t i = threadIdx.x; i < kOwn * (share.last_node - share.first_node); i += kLmThreads)
        memory.own[i] = 0;
    for (uint32_t i = threadIdx.x; i < 36 * (share.last_place - share.first_place); i += kLmThreads)
        memory.matrix[i] = 0;
    __syncthreads();
}

// Its own rows to the others.
__device__ __forceinline__ void give_system(const LmView& view, const LmMemory& memory,
                                            const LmShare& share, uint32_t copy) {
    const uint32_t rows = share.last_node - share.first_node, nodes = view.p.nodes;
    float* diagonals = view.exchange.diagonals + size_t{copy} * kDiagonal * nodes;
    for (uint32_t i = threadIdx.x; i < kDiagonal * rows; i += kLmThreads) {
        const uint32_t at = i / rows, row = i % rows;
        uint32_t r = 0;  // of the lower triangle
        while (triangle(r + 1, 0) <= at) ++r;
        const uint32_t entry =
            at < kFactor ? 6 * (at - triangle(r, 0)) + r : 6 * kGradientColumn + at - kFactor;
        diagonals[size_t{at} * nodes + share.first_node + row] = memory.own[kOwn * row + entry];
    }
    float* matrix =
        view.exchange.matrix + 36 * (size_t{copy} * view.surface.places + share.first_place);
    for (uint32_t i = threadIdx.x; i < 36 * (share.last_place - share.first_place); i += kLmThreads)
        matrix[i] = memory.matrix[i];
}

// D of each control point from the system of the items alone, and S of the connections from them.
__device__ __forceinline__ void measure_data(const LmView& view, const LmMemory& memory,
                                             const LmShare& share) {
    const uint32_t thread = threadIdx.x, rows = share.last_node - share.first_node;
    float squares[2] = {};
    for (uint32_t row = thread; row < rows; row += kLmThreads) {
        const float data = memory.own[kOwn * row + 6 * kDataColumn + 3];
        view.exchange.data[share.first_node + row] = data;
        squares[0] += data;
        squares[1] += data * data;
    }
    __shared__ float warps[kLmWarps][2];
    block_sums(squares, warps);
    if (thread == 0) view.exchange.data_sums[blockIdx.x] = make_float2(squares[0], squares[1]);
    GridBarrier(view.exchange.passed).wait();
    float sums[2] = {};
    for (uint32_t block = thread; block < gridDim.x; block += kLmThreads) {
        const float2 part = view.exchange.data_sums[block];
        sums[0] += part.x;
        sums[1] += part.y;
    }
    block_sums(sums, warps);
    const float usual = sums[0] > 0 ? sums[1] / sums[0] : 0.0f;
    for (uint32_t c = share.first_connection + thread; c < share.last_connection; c += kLmThreads) {
        const LmConnection& connection = view.surface.connections[c];
        const float both = view.exchange.data[memory.known[connection.i]] +
                           view.exchange.data[memory.known[connection.j]];
        view.exchange.scales[c] = connection.share * (0.5f * both + usual) * 0.5f;
    }
    __syncthreads();
}

// All residuals by the poses that memory holds, and with `linearise` the system, into that copy.
// kBegins: those are the poses to start from, by which S is measured. farthest: see kFarthest.
template <bool kBegins>
__device__ __forceinline__ void evaluate(const LmView& view, const LmMemory& memory,
                                         const LmShare& share, bool linearise, float farthest,
                                         uint32_t copy) {
    if (linearise) clear_system(memory, share);
    float sums[kSums] = {};
    LmLoaded loaded{~0u, 0};
    if constexpr (kBegins) {
        add_residuals(view, memory, share, {true, false}, true, loaded, sums);
        measure_data(view, memory, share);
        add_residuals(view, memory, share, {false, true}, true, loaded, sums);
    } else {
        add_residuals(view, memory, share, {true, true}, linearise, loaded, sums);
    }
    publish_sums(sums, farthest, view.exchange.sums);
    if (linearise) give_system(view, memory, share, copy);
}

}  // namespace
}  // namespace defrec::cuda
