// The cost by the trial poses, and the system there: each block its own rows.
#pragma once
#include "backends/cuda/lm_residuals.cuh"
#include "backends/shared/levenberg_marquardt.hpp"

namespace defrec::cuda {
namespace {

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

// Entry of a lower triangle that is kept row by row, c <= r.
constexpr uint32_t triangle(uint32_t r, uint32_t c) { return r * (r + 1) / 2 + c; }

// Of a symmetric block, given by its lower triangle: the inverse of its Cholesky factor, in its
// place. Pivots that vanish in single precision are raised to a share of the diagonal.
__device__ __forceinline__ void invert_factor(float (&block)[kFactor]) {
    constexpr float kLeastPivot = 1e-6f;
    float inverse_pivot[6];
    for (uint32_t c = 0; c < 6; ++c) {
        const float given = block[triangle(c, c)];
        float pivot = given;
        for (uint32_t k = 0; k < c; ++k)
            pivot = fmaf(-block[triangle(c, k)], block[triangle(c, k)], pivot);
        inverse_pivot[c] = rsqrtf(fmaxf(pivot, kLeastPivot * given));
        for (uint32_t r = c + 1; r < 6; ++r) {
            float value = block[triangle(r, c)];
            for (uint32_t k = 0; k < c; ++k)
                value = fmaf(-block[triangle(r, k)], block[triangle(c, k)], value);
            block[triangle(r, c)] = value * inverse_pivot[c];
        }
    }
    for (uint32_t c = 0; c < 6; ++c) {
        block[triangle(c, c)] = inverse_pivot[c];
        for (uint32_t r = c + 1; r < 6; ++r) {
            float value = block[triangle(r, c)] * inverse_pivot[c];
            for (uint32_t k = c + 1; k < r; ++k)
                value = fmaf(block[triangle(r, k)], block[triangle(k, c)], value);
            block[triangle(r, c)] = -value * inverse_pivot[r];
        }
    }
}

// Marquardt's damping of the control points' blocks, a thread each; the inverses of their factors,
// which condition the system, and the right side with them. What has no weight at all gets one, and
// stays where it is.
__device__ __forceinline__ void damp(const LmView& view, const LmMemory& memory,
                                     const LmShare& share, float lambda, uint32_t copy) {
    const uint32_t rows = share.last_node - share.first_node;
    for (uint32_t row = threadIdx.x; row < rows; row += kLmThreads) {
        const float* own = memory.own + kOwn * row;
        float trace = 0;
        for (uint32_t r = 0; r < 6; ++r) trace += own[7 * r];
        const float least = trace > 0 ? float(kMinDiagonal) * trace : 1.0f;
        float inverse[kFactor];
        for (uint32_t r = 0; r < 6; ++r) {
            for (uint32_t c = 0; c < r; ++c) inverse[triangle(r, c)] = own[6 * c + r];
            inverse[triangle(r, r)] = fmaf(own[7 * r], 1 + lambda, least);
        }
        invert_factor(inverse);
        const uint32_t node = share.first_node + row;
        float* out = view.exchange.factors + size_t{copy} * kFactor * view.p.nodes + node;
        float* own_factor = memory.own_factors + kOwnFactor * row;
        for (uint32_t at = 0; at < kFactor; ++at)
            out[size_t{at} * view.p.nodes] = own_factor[at] = inverse[at];
        float* start = view.exchange.starts + size_t{copy} * 6 * view.p.nodes + 6 * node;
        for (uint32_t r = 0; r < 6; ++r) {
            float value = 0;
            for (uint32_t c = 0; c <= r; ++c)
                value = fmaf(-inverse[triangle(r, c)], own[6 * kGradientColumn + c], value);
            start[r] = value;
        }
    }
}

// Places times their rows' factor: half of the conditioning, the other half when all factors are
// known.
__device__ __forceinline__ void condition_rows(const LmView& view, const LmMemory& memory,
                                               const LmShare& share) {
    const uint32_t count = 6 * (share.last_place - share.first_place);
    for (uint32_t u = threadIdx.x; u < count; u += kLmThreads) {
        const float* factor =
            memory.own_factors + kOwnFactor * view.surface.places[share.first_place + u / 6].row;
        float* column = memory.matrix + 36 * (u / 6) + u % 6;
        float before[6];
        for (uint32_t r = 0; r < 6; ++r) before[r] = column[6 * r];
        for (uint32_t r = 0, at = 0; r < 6; ++r) {
            float value = 0;
            for (uint32_t c = 0; c <= r; ++c, ++at) value = fmaf(factor[at], before[c], value);
            column[6 * r] = value;
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

// Of damping lambda, into the given copy.
__device__ __forceinline__ void finish_system(const LmView& view, const LmMemory& memory,
                                              const LmShare& share, float lambda, uint32_t copy) {
    damp(view, memory, share, lambda, copy);
    __syncthreads();
    if (view.p.steps > 0) condition_rows(view, memory, share);
}

// D of each control point from the system of the items alone, and S of the connections from them.
__device__ __forceinline__ void measure_data(const LmView& view, const LmMemory& memory,
                                             const LmShare& share, GridBarrier& barrier) {
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
    barrier.wait();
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

// All residuals by the poses that memory holds. With a system, it is that of damping lambda, in the
// given copy. begins: those are the poses to start from, by which S is measured. farthest: see
// kFarthest. Called in one place: its code is most of the kernel's, and more than the
// multiprocessor's cache of instructions holds.
__device__ __forceinline__ void evaluate(const LmView& view, const LmMemory& memory,
                                         const LmShare& share, bool begins, bool linearise,
                                         float lambda, float farthest, uint32_t copy,
                                         LmLoaded& loaded, GridBarrier& barrier) {
    if (linearise) clear_system(memory, share);
    float sums[kSums] = {};
    LmKinds kinds{true, !begins};
#pragma unroll 1
    for (;;) {
        add_residuals(view, memory, share, kinds, linearise, loaded, sums);
        if (kinds.connections) break;
        measure_data(view, memory, share, barrier);
        kinds = {false, true};
    }
    publish_sums(sums, farthest, view.exchange.sums + size_t{copy} * gridDim.x * kSums);
    if (linearise) finish_system(view, memory, share, lambda, copy);
}

}  // namespace
}  // namespace defrec::cuda
