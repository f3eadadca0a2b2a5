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

constexpr uint32_t kColumns = 8, kGradientColumn = 6,
                   kDataColumn = 7;  // of a warp's sums: a block's six, half the gradient, D

// Column of the block that a term adds to, as (arm x v; v).
__device__ __forceinline__ Vec3<float> column_shift(const float* record, uint32_t k, uint32_t l,
                                                    uint32_t column) {
    const auto at = [record](uint32_t component) { return record[component * kLmChunk]; };
    const float weight = at(kSkin + k);
    if (column == kDataColumn) return {weight * at(kWeight), 0, 0};
    if (column == kGradientColumn)
        return weight * Vec3<float>{at(kPull), at(kPull + 1), at(kPull + 2)};
    const Vec3<float> unit{column % 3 == 0 ? 1.0f : 0.0f, column % 3 == 1 ? 1.0f : 0.0f,
                           column % 3 == 2 ? 1.0f : 0.0f};
    const Vec3<float> arm{at(kArms + 3 * l), at(kArms + 3 * l + 1), at(kArms + 3 * l + 2)};
    const Vec3<float> u = column < 3 ? cross(unit, arm) : unit;
    const float both = weight * at(kSkin + l);
    const float xx = at(kSquares), xy = at(kSquares + 1), xz = at(kSquares + 2),
                yy = at(kSquares + 3), yz = at(kSquares + 4), zz = at(kSquares + 5);
    return both * Vec3<float>{xx * u.x + xy * u.y + xz * u.z, xy * u.x + yy * u.y + yz * u.z,
                              xz * u.x + yz * u.y + zz * u.z};
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

// A warp for each block of the matrix: eight lanes for its columns, and four times those to share
// its terms.
__device__ __forceinline__ void add_sums(const LmMemory& memory, uint32_t count, LmKinds kinds,
                                         uint32_t rows) {
    constexpr uint32_t kSplit = kWarp / kColumns;
    const uint32_t lane = threadIdx.x % kWarp, column = lane % kColumns, split = lane / kColumns;
    for (uint32_t s = threadIdx.x / kWarp; s < count; s += kLmWarps) {
        const LmSum sum = memory.sums[s];
        if (sum.target == kLmNoTarget) break;
        const bool diagonal = sum.target < rows;
        if (!kinds.items && !diagonal) continue;
        float total[6] = {};
        if (kinds.items && (diagonal || column < 6))
            for (uint32_t at = sum.first_term + split; at < sum.last_term; at += kSplit) {
                const uint32_t term = memory.terms[at], k = (term >> 2) & 3, l = term & 3;
                if (column >= kGradientColumn && k != l) continue;
                const float* record = memory.records + (term >> 4);
                const Vec3<float> v = column_shift(record, k, l, column);
                const Vec3<float> arm{record[(kArms + 3 * k) * kLmChunk],
                                      record[(kArms + 3 * k + 1) * kLmChunk],
                                      record[(kArms + 3 * k + 2) * kLmChunk]};
                const Vec3<float> turn = cross(arm, v);
                const float six[6] = {turn.x, turn.y, turn.z, v.x, v.y, v.z};
                for (int r = 0; r < 6; ++r) total[r] += six[r];
            }
        if (kinds.connections && diagonal && column != kDataColumn)
            for (uint32_t c = sum.first_connection + split; c < sum.last_connection; c += kSplit)
                for (uint32_t r = 0; r < 6; ++r)
                    total[r] +=
                        memory.connection_records[connection_component(r, column) * kLmChunk + c];
        for (uint32_t apart = kColumns; apart < kWarp; apart *= 2)
            for (float& value : total)
                value += __shfl_xor_sync(kAllLanes, value, static_cast<int>(apart));
        if (split != 0) continue;
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
