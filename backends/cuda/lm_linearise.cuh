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

// A warp for each block of the matrix: eight lanes for its columns, and four times those to share
// its terms.
__device__ __forceinline__ void add_sums(const LmMemory& memory, uint32_t count, bool only_data,
                                         uint32_t rows) {
    constexpr uint32_t kSplit = kWarp / kColumns;
    const uint32_t lane = threadIdx.x % kWarp, column = lane % kColumns, split = lane / kColumns;
    for (uint32_t s = threadIdx.x / kWarp; s < count; s += kLmWarps) {
        const LmSum sum = memory.sums[s];
        const bool diagonal = sum.target < rows;
        if (only_data && !diagonal) continue;
        float total[6] = {};
        if (diagonal || column < 6)
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
        if (!only_data && diagonal && column != kDataColumn)
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

// own = F^-1 with F F^T = block. Pivots that vanish in single precision are raised.
__device__ __forceinline__ void invert_factor(const float (&block)[kFactor],
                                              float (&own)[kFactor]) {
    constexpr auto at = [](int r, int c) { return r * (r + 1) / 2 + c; };
    float factor[kFactor];
    for (int c = 0; c < 6; ++c)
        for (int r = c; r < 6; ++r) {
            float value = block[at(r, c)];
            const float minimum = value * 1e-6f;
            for (int k = 0; k < c; ++k) value -= factor[at(r, k)] * factor[at(c, k)];
            if (r == c)
                own[at(c, c)] = rsqrtf(fmaxf(value, minimum));
            else
                factor[at(r, c)] = value * own[at(c, c)];
        }
    for (int c = 0; c < 6; ++c)
        for (int r = c + 1; r < 6; ++r) {
            float value = 0;
            for (int k = c; k < r; ++k) value -= factor[at(r, k)] * own[at(k, c)];
            own[at(r, c)] = value * own[at(r, r)];
        }
}

// Marquardt's damping of a control point's block, whose factor is what conditions the system; the
// right side with it. What has no weight at all gets one, and stays where it is.
__device__ __forceinline__ void damp(const LmView& view, const float* own, float lambda,
                                     uint32_t node, uint32_t copy, float* own_factor) {
    float block[kFactor], factor[kFactor], trace = 0;
    for (uint32_t r = 0; r < 6; ++r) trace += own[7 * r];
    const float minimum = trace > 0 ? float(kMinDiagonal) * trace : 1.0f;
    for (uint32_t r = 0, at = 0; r < 6; ++r)
        for (uint32_t c = 0; c <= r; ++c, ++at)
            block[at] = r == c ? own[7 * r] * (1 + lambda) + minimum : own[6 * c + r];
    invert_factor(block, factor);
    float* out = view.exchange.factors + size_t{copy} * kFactor * view.p.nodes + node;
    float* start = view.exchange.starts + size_t{copy} * 6 * view.p.nodes + 6 * node;
    for (uint32_t r = 0, at = 0; r < 6; ++r) {
        float value = 0;
        for (uint32_t c = 0; c <= r; ++c, ++at) {
            out[size_t{at} * view.p.nodes] = own_factor[at] = factor[at];
            value -= factor[at] * own[6 * kGradientColumn + c];
        }
        start[r] = value;
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

// All residuals by the poses that memory holds. With a system, it is that of damping lambda, in the
// given copy. farthest: see kFarthest.
__device__ __forceinline__ void evaluate(const LmView& view, const LmMemory& memory,
                                         const LmShare& share, bool linearise, float lambda,
                                         float farthest, uint32_t copy, LmLoaded& loaded) {
    const uint32_t thread = threadIdx.x, rows = share.last_node - share.first_node;
    if (linearise) {
        for (uint32_t i = thread; i < kOwn * rows; i += kLmThreads) memory.own[i] = 0;
        for (uint32_t i = thread; i < 36 * (share.last_place - share.first_place); i += kLmThreads)
            memory.matrix[i] = 0;
        __syncthreads();
    }
    float sums[kSums] = {};
    const uint32_t slot = thread % kLmChunk;
    for (uint32_t chunk = 0; chunk < share.chunks; ++chunk) {
        const uint32_t item = share.first_item + chunk * kLmChunk + slot,
                       connection = share.first_connection + chunk * kLmChunk + slot;
        if (linearise) load_terms(view, memory, share.first_chunk + chunk, loaded);
        if (thread < kLmChunk) {
            if (item < share.last_item) evaluate_item(view, memory, item, slot, linearise, sums);
        } else if (connection < share.last_connection) {
            evaluate_connection(view, memory, connection, slot, linearise, sums);
        }
        if (!linearise) continue;
        __syncthreads();
        add_sums(memory, loaded.sums, false, rows);
        __syncthreads();
    }
    publish_sums(sums, farthest, view.exchange.sums + size_t{copy} * gridDim.x * kSums);
    if (!linearise) return;
    for (uint32_t row = thread; row < rows; row += kLmThreads)
        damp(view, memory.own + kOwn * row, lambda, share.first_node + row, copy,
             memory.own_factors + kOwnFactor * row);
    __syncthreads();
    if (view.p.steps > 0) condition_rows(view, memory, share);
}

// D of each control point by the poses that memory holds, and S of the connections from them.
__device__ __forceinline__ void measure_data(const LmView& view, const LmMemory& memory,
                                             const LmShare& share, LmLoaded& loaded) {
    const uint32_t thread = threadIdx.x, rows = share.last_node - share.first_node;
    for (uint32_t i = thread; i < kOwn * rows; i += kLmThreads) memory.own[i] = 0;
    __syncthreads();
    float unused[kSums] = {};
    for (uint32_t chunk = 0; chunk < share.chunks; ++chunk) {
        const uint32_t item = share.first_item + chunk * kLmChunk + thread;
        load_terms(view, memory, share.first_chunk + chunk, loaded);
        if (thread < kLmChunk && item < share.last_item)
            evaluate_item(view, memory, item, thread, true, unused);
        __syncthreads();
        add_sums(memory, loaded.sums, true, rows);
        __syncthreads();
    }
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
    sync_grid();
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

}  // namespace
}  // namespace defrec::cuda
