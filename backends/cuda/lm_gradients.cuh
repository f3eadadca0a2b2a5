// The system's solution by conjugate gradients, by a few blocks that own the rows of many control
// points each: a cluster where the device has them, whose barrier is quick. Conditioned on both
// sides by the factors of its damped diagonal blocks the system has ones on the diagonal, and the
// steps are those of the preconditioned method (docs/stages/lm.md). One barrier for each step:
// blocks pass on their rows of the product and their parts of four dot products, and each updates
// the vectors of all control points that it knows.
#pragma once
#include "backends/cuda/lm_linearise.cuh"
#include "backends/cuda/lm_poses.cuh"
#include "backends/cuda/vector_loads.cuh"

namespace defrec::cuda {

// Eight threads share three rows of the matrix, which have the same places: each holds some of
// these in registers, and what it loads of the vector serves all three rows.
constexpr uint32_t kRowThreads = 640, kRowWarps = kRowThreads / 32, kRowSplit = 8,
                   kRowsTogether = 3, kHeld = 2;
constexpr uint32_t kMaxRowBlocks = 16;  // whose parts of the dot products find room

// As lm_row_memory takes it.
constexpr size_t lm_row_floats(const LmRowPlan& plan) {
    const size_t floats = (36 + 1) * size_t{plan.max_places} +
                          (kFactorRoom + 3 * 6 + 1) * size_t{plan.rows} + 1 +
                          (2 * 6 + 2) * size_t{plan.max_known};
    return (floats + 3) / 4 * 4;
}

struct LmRowMemory {
    float* matrix;                           // its places
    float *factors, *solution;               // of its own control points
    float* products;                         // likewise, two copies
    float *direction, *residual;             // of the control points that it knows
    uint32_t* columns;                       // of its places
    uint32_t* row_places;                    // of its own control points, and the end
    uint32_t *known, *owners;                // owner's block << 16 | place among its own
    uint32_t rows, places, count, max_rows;  // its own control points, and known ones
};

namespace {

// kShared: everything is in shared memory.
template <bool kShared>
__device__ __forceinline__ LmRowMemory lm_row_memory(const LmView& view, const LmRowShare& share) {
    const LmRows& plan = view.rows;
    float* at = kShared ? dynamic_shared<float>()
                        : view.exchange.row_local + blockIdx.x * view.exchange.row_local_floats;
    const auto take = [&at](size_t floats) {
        float* taken = at;
        at += floats;
        return taken;
    };
    LmRowMemory memory{};
    memory.matrix = take(36 * size_t{plan.max_places});
    memory.factors = take(kFactorRoom * size_t{plan.rows});
    memory.solution = take(6 * size_t{plan.rows});
    memory.products = take(2 * 6 * size_t{plan.rows});
    memory.direction = take(6 * size_t{plan.max_known});
    memory.residual = take(6 * size_t{plan.max_known});
    memory.columns = reinterpret_cast<uint32_t*>(take(plan.max_places));
    memory.known = reinterpret_cast<uint32_t*>(take(plan.max_known));
    memory.owners = reinterpret_cast<uint32_t*>(take(plan.max_known));
    memory.row_places = reinterpret_cast<uint32_t*>(take(plan.rows + 1));
    const uint32_t first = share.first_place;
    memory.rows = share.last_node - share.first_node;
    memory.places = share.last_place - first;
    memory.count = share.last_known - share.first_known;
    memory.max_rows = plan.rows;
    // All loads before the first is stored: what is beyond these is little or nothing.
    const uint32_t me = threadIdx.x;
    const uint32_t column = me < memory.places ? plan.places[first + me].column : 0,
                   node = me < memory.count ? plan.known[share.first_known + me] : 0,
                   row_place = me <= memory.rows ? plan.row_places[share.first_node + me] : 0;
    const auto set_known = [&](uint32_t i, uint32_t known) {
        memory.known[i] = known;
        memory.owners[i] = known / plan.rows << 16 | known % plan.rows;
    };
    if (me < memory.places) memory.columns[me] = column;
    if (me < memory.count) set_known(me, node);
    if (me <= memory.rows) memory.row_places[me] = row_place - first;
    for (uint32_t i = me + kRowThreads; i < memory.places; i += kRowThreads)
        memory.columns[i] = plan.places[first + i].column;
    for (uint32_t i = me + kRowThreads; i < memory.count; i += kRowThreads)
        set_known(i, plan.known[share.first_known + i]);
    for (uint32_t i = me + kRowThreads; i <= memory.rows; i += kRowThreads)
        memory.row_places[i] = plan.row_places[share.first_node + i] - first;
    return memory;
}

// Replaces a symmetric block, given by its lower triangle, by the inverse of its Cholesky factor.
// Pivots that vanish in single precision are raised to a share of the diagonal.
__device__ __forceinline__ void invert_factor(float (&block)[kFactor]) {
    float inverse_pivot[6];
    for (uint32_t c = 0; c < 6; ++c) {
        const float given = block[triangle(c, c)];
        float pivot = given;
        for (uint32_t k = 0; k < c; ++k)
            pivot = fmaf(-block[triangle(c, k)], block[triangle(c, k)], pivot);
        inverse_pivot[c] = rsqrtf(fmaxf(pivot, kMinPivot * given));
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

// A control point's diagonal block and half the gradient.
__device__ __forceinline__ void load_diagonal(const LmView& view, uint32_t copy, uint32_t node,
                                              float* diagonal) {
    const uint32_t nodes = view.p.nodes;
    const float* given = view.exchange.diagonals + size_t{copy} * kDiagonal * nodes + node;
    for (uint32_t at = 0; at < kDiagonal; ++at) diagonal[at] = given[size_t{at} * nodes];
}

// Marquardt's damping of a control point of the block; the inverse of its factor, which conditions
// the system, and the right side with it. What has no weight at all gets one, and stays where it
// is.
__device__ __forceinline__ void damp(const LmView& view, const LmRowMemory& memory, uint32_t row,
                                     uint32_t node, float lambda, const float* diagonal) {
    float inverse[kFactor], trace = 0;
    for (uint32_t at = 0; at < kFactor; ++at) inverse[at] = diagonal[at];
    for (uint32_t r = 0; r < 6; ++r) trace += inverse[triangle(r, r)];
    const float least = trace > 0 ? float(kMinDiagonal) * trace : 1.0f;
    for (uint32_t r = 0; r < 6; ++r)
        inverse[triangle(r, r)] = fmaf(inverse[triangle(r, r)], 1 + lambda, least);
    invert_factor(inverse);
    float* out = view.exchange.factors + kFactorRoom * size_t{node};
    for (uint32_t at = 0; at < kFactor; ++at)
        out[at] = memory.factors[kFactorRoom * row + at] = inverse[at];
    for (uint32_t r = 0; r < 6; ++r) {
        float value = 0;
        for (uint32_t c = 0; c <= r; ++c)
            value = fmaf(-inverse[triangle(r, c)], diagonal[kFactor + c], value);
        view.exchange.starts[6 * size_t{node} + r] = value;
    }
}

// A place, as nine vectors, by one thread.
struct LmBlock {
    float value[36];
};
// Times its column's factor, transposed, and its row's.
__device__ __forceinline__ void condition(LmBlock& block, const float* row_factor,
                                          const float* column_factor, float* to) {
    float factor[kFactorRoom];
    load_fours(column_factor, factor);
    for (uint32_t r = 0; r < 6; ++r)
        for (uint32_t back = 0; back < 6; ++back) {  // none is needed once it is overwritten
            const uint32_t c = 5 - back;
            float sum = 0;
            for (uint32_t k = 0; k <= c; ++k)
                sum = fmaf(factor[triangle(c, k)], block.value[6 * r + k], sum);
            block.value[6 * r + c] = sum;
        }
    load_fours(row_factor, factor);
    auto* vectors = reinterpret_cast<float4*>(to);
    for (uint32_t i = 0; i < 9; ++i) {
        float four[4];
        for (uint32_t j = 0; j < 4; ++j) {
            const uint32_t r = (4 * i + j) / 6, c = (4 * i + j) % 6;
            four[j] = 0;
            for (uint32_t k = 0; k <= r; ++k)
                four[j] = fmaf(factor[triangle(r, k)], block.value[6 * k + c], four[j]);
        }
        vectors[i] = make_float4(four[0], four[1], four[2], four[3]);
    }
}

// The places of three rows that the thread holds.
struct LmHeldRows {
    float2 value[kHeld][kRowsTogether][3];
    uint32_t column[kHeld];
};
// Three rows of a place; which of the two threes follows from the number of the first row.
__device__ __forceinline__ const float2* rows_at(const LmRowMemory& memory, uint32_t place,
                                                 uint32_t row) {
    return reinterpret_cast<const float2*>(memory.matrix + 36 * size_t{place} + 6 * (row % 6));
}
__device__ __forceinline__ void hold_rows(const LmRowMemory& memory, LmHeldRows& held) {
    const uint32_t row = threadIdx.x / kRowSplit * kRowsTogether;
    const uint32_t first = row < 6 * memory.rows ? memory.row_places[row / 6] : 0,
                   last = row < 6 * memory.rows ? memory.row_places[row / 6 + 1] : 0;
#pragma unroll
    for (uint32_t k = 0; k < kHeld; ++k) {
        const uint32_t place = first + threadIdx.x % kRowSplit + kRowSplit * k;
        const bool is_there = place < last;
        held.column[k] = is_there ? 6 * memory.columns[place] : 0;
        for (uint32_t r = 0; r < kRowsTogether; ++r)
            for (uint32_t i = 0; i < 3; ++i)
                held.value[k][r][i] =
                    is_there ? rows_at(memory, place, row)[3 * r + i] : make_float2(0, 0);
    }
}

// Matrix times direction in three rows from `row` on, without the diagonal; to the first three of
// the threads that share them one each, to the others anything.
__device__ __forceinline__ float multiply_rows(const LmRowMemory& memory, const LmHeldRows& held,
                                               uint32_t row) {
    float2 sum[kRowsTogether];
    for (float2& two : sum) two = make_float2(0, 0);
    const auto add = [&](uint32_t r, const float2(&x)[3], float2 a, float2 b, float2 c) {
        sum[r].x = fmaf(c.x, x[2].x, fmaf(b.x, x[1].x, fmaf(a.x, x[0].x, sum[r].x)));
        sum[r].y = fmaf(c.y, x[2].y, fmaf(b.y, x[1].y, fmaf(a.y, x[0].y, sum[r].y)));
    };
    const auto load_direction = [&](uint32_t at, float2(&x)[3]) {
        for (uint32_t i = 0; i < 3; ++i)
            x[i] = reinterpret_cast<const float2*>(memory.direction + at)[i];
    };
    const bool holds = row == threadIdx.x / kRowSplit * kRowsTogether;
    if (holds) {
#pragma unroll
        for (uint32_t k = 0; k < kHeld; ++k) {
            float2 x[3];
            load_direction(held.column[k], x);
            for (uint32_t r = 0; r < kRowsTogether; ++r)
                add(r, x, held.value[k][r][0], held.value[k][r][1], held.value[k][r][2]);
        }
    }
    if (row < 6 * memory.rows) {
        const uint32_t last = memory.row_places[row / 6 + 1];
        for (uint32_t place = memory.row_places[row / 6] + threadIdx.x % kRowSplit +
                              (holds ? kRowSplit * kHeld : 0);
             place < last; place += kRowSplit) {
            const float2* a = rows_at(memory, place, row);
            float2 x[3];
            load_direction(6 * memory.columns[place], x);
            for (uint32_t r = 0; r < kRowsTogether; ++r)
                add(r, x, a[3 * r], a[3 * r + 1], a[3 * r + 2]);
        }
    }
    float of_row[kRowsTogether];
    for (uint32_t r = 0; r < kRowsTogether; ++r) {
        of_row[r] = sum[r].x + sum[r].y;
        for (uint32_t apart = kRowSplit / 2; apart > 0; apart /= 2)
            of_row[r] += __shfl_xor_sync(kAllLanes, of_row[r], static_cast<int>(apart));
    }
    const uint32_t which = threadIdx.x % kRowSplit;
    return which == 0 ? of_row[0] : which == 1 ? of_row[1] : of_row[2];
}

enum LmProductOf : uint32_t {
    kDirectionProduct,
    kResidualProduct,
    kProductProduct,
    kResidualResidual,
    kProducts
};

// What blocks pass to each other in a step: their rows of the product, and their parts of the dot
// products. Through the shared memory of a cluster, else through global memory; of each there are
// two copies, used in turn: a block that is ahead never writes what another still reads.
template <class Barrier>
struct LmChannel {
    const LmRowMemory& memory;
    float *products, *own_products;  // of all that the thread may read, and of the block's own rows
    float4* dots;
    uint32_t copy, product_copies, dot_copies;  // how far the second copy lies behind the first

    __device__ LmChannel(const LmView& view, const LmRowMemory& given, const LmRowShare& share,
                         float4* shared_dots)
        : memory(given), copy(0) {
        if constexpr (Barrier::kSharesMemory) {
            products = own_products = memory.products;
            dots = shared_dots;
            product_copies = 6 * memory.max_rows;
            dot_copies = kMaxRowBlocks;
        } else {
            products = view.exchange.products;
            own_products = products + 6 * share.first_node;
            dots = view.exchange.dots;
            product_copies = 6 * view.p.nodes;
            dot_copies = gridDim.x;
        }
    }
    __device__ void give_product(uint32_t row, float value) const {
        own_products[copy * size_t{product_copies} + row] = value;
    }
    // By the block's first threads, as many as there are blocks.
    __device__ void give_dots(float4 sum) const {
        float4* to = dots + copy * dot_copies + blockIdx.x;
        if constexpr (Barrier::kSharesMemory)
            Barrier::store(to, threadIdx.x, sum);
        else if (threadIdx.x == 0)
            *to = sum;
    }
    // Where entry i of the product is, of a control point that the block knows: rank << 16 | place,
    // or the place.
    __device__ uint32_t place_of(uint32_t i) const {
        if constexpr (Barrier::kSharesMemory) {
            const uint32_t owner = memory.owners[i / 6];
            return (owner & 0xffff0000) | (6 * (owner & 0xffff) + i % 6);
        } else {
            return 6 * memory.known[i / 6] + i % 6;
        }
    }
    __device__ float product(uint32_t place) const {
        const float* of_copy = products + copy * size_t{product_copies};
        if constexpr (Barrier::kSharesMemory)
            return Barrier::load(of_copy + (place & 0xffff), place >> 16);
        else
            return of_copy[place];
    }
    __device__ float4 all_dots() const;
};

__device__ __forceinline__ float4 operator+(float4 a, float4 b) {
    return make_float4(a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w);
}
// The sum of at most as many as a warp has lanes, to each of its lanes.
__device__ __forceinline__ float4 sum_of(const float4* parts, uint32_t count) {
    constexpr uint32_t kLanes = kWarp / kProducts;  // that end with the same sum
    const uint32_t lane = threadIdx.x % kWarp;
    const float4 own = lane < count ? parts[lane] : make_float4(0, 0, 0, 0);
    float values[kProducts] = {own.x, own.y, own.z, own.w};
    const float sum = warp_sums(values);
    return make_float4(__shfl_sync(kAllLanes, sum, 0), __shfl_sync(kAllLanes, sum, kLanes),
                       __shfl_sync(kAllLanes, sum, 2 * kLanes),
                       __shfl_sync(kAllLanes, sum, 3 * kLanes));
}

template <class Barrier>
__device__ float4 LmChannel<Barrier>::all_dots() const {
    const float4* of_copy = dots + copy * dot_copies;
    float4 sum = sum_of(of_copy, min(gridDim.x, kWarp));
    for (uint32_t first = kWarp; first < gridDim.x; first += kWarp)
        sum = sum + sum_of(of_copy + first, min(gridDim.x - first, kWarp));
    return sum;
}

// The block's rows of matrix times direction, and its part of the dot products.
template <class Barrier>
__device__ __forceinline__ void multiply(const LmRowMemory& memory, const LmHeldRows& held,
                                         const LmChannel<Barrier>& channel, float4* warps) {
    constexpr uint32_t kRows = kRowThreads / kRowSplit * kRowsTogether;
    float parts[kProducts] = {};
    for (uint32_t first = 0; first < 6 * memory.rows; first += kRows) {
        const uint32_t three = first + threadIdx.x / kRowSplit * kRowsTogether,
                       which = threadIdx.x % kRowSplit, row = three + which;
        const float sum = multiply_rows(memory, held, three);
        if (which >= kRowsTogether || row >= 6 * memory.rows) continue;
        const float p = memory.direction[row], r = memory.residual[row], q = sum + p;
        channel.give_product(row, q);
        parts[kDirectionProduct] = fmaf(p, q, parts[kDirectionProduct]);
        parts[kResidualProduct] = fmaf(r, q, parts[kResidualProduct]);
        parts[kProductProduct] = fmaf(q, q, parts[kProductProduct]);
        parts[kResidualResidual] = fmaf(r, r, parts[kResidualResidual]);
    }
    constexpr uint32_t kLanes = kWarp / kProducts;  // that end with the same sum
    const uint32_t lane = threadIdx.x % kWarp;
    const float sum = warp_sums(parts);
    if (lane % kLanes == 0)
        reinterpret_cast<float*>(warps + threadIdx.x / kWarp)[lane / kLanes] = sum;
    __syncthreads();
    if (threadIdx.x >= kWarp) return;
    const float4 all = sum_of(warps, kRowWarps);
    if (threadIdx.x < gridDim.x) channel.give_dots(all);
}

// The solution, conditioned, of the conditioned system.
template <class Barrier>
__device__ __forceinline__ void solve(const LmView& view, const LmRowMemory& memory,
                                      const LmRowShare& share, Barrier& barrier) {
    alignas(16) __shared__ float shared_dots[2 * kMaxRowBlocks * kProducts];
    alignas(16) __shared__ float shared_warps[kRowWarps * kProducts];
    auto* warps = reinterpret_cast<float4*>(shared_warps);
    const uint32_t count = 6 * memory.count;
    LmChannel<Barrier> channel(view, memory, share, reinterpret_cast<float4*>(shared_dots));
    LmHeldRows held;
    hold_rows(memory, held);
    const uint32_t first = channel.place_of(min(threadIdx.x, count - 1));
    float enough = 0;
    for (uint32_t step = 0; step < view.p.steps; ++step, channel.copy ^= 1) {
        multiply(memory, held, channel, warps);
        barrier.wait();
        const float ahead = channel.product(first);  // loaded before the sums are known
        const float4 dots = channel.all_dots();
        const float rho = dots.w, curvature = dots.x;
        if (step == 0) enough = float(kConjugateTolerance * kConjugateTolerance) * rho;
        if (!(rho > enough) || !(curvature > 0)) break;
        const float alpha = rho / curvature;
        const float next = fmaxf(fmaf(alpha, fmaf(alpha, dots.z, -2 * dots.y), rho), 0.0f);
        const float beta = next / rho;
        const auto update = [&](uint32_t i, float product) {
            const float direction = memory.direction[i],
                        residual = fmaf(-alpha, product, memory.residual[i]);
            if (i < 6 * memory.rows)
                memory.solution[i] = fmaf(alpha, direction, memory.solution[i]);
            memory.residual[i] = residual;
            memory.direction[i] = fmaf(beta, direction, residual);
        };
        if (threadIdx.x < count) update(threadIdx.x, ahead);
        for (uint32_t i = threadIdx.x + kRowThreads; i < count; i += kRowThreads)
            update(i, channel.product(channel.place_of(i)));
        __syncthreads();
        if (!(next > enough)) break;
    }
    // No block goes while another reads its memory.
    if constexpr (Barrier::kSharesMemory)
        barrier.wait();
    else
        __syncthreads();
}

// Entry i of the solution, as the control points move.
__device__ __forceinline__ float step_entry(const LmRowMemory& memory, uint32_t i) {
    const float* factor = memory.factors + kFactorRoom * size_t{i / 6};
    const uint32_t c = i % 6;
    float sum = 0;
    for (uint32_t r = c; r < 6; ++r)
        sum = fmaf(factor[triangle(r, c)], memory.solution[i - c + r], sum);
    return sum;
}

// Ends a run whose last step is trusted: takes that step, where there is one, and gives the results
// of the block's own control points.
template <class Barrier>
__device__ __forceinline__ void take_last_step(const LmView& view, const LmRowMemory& memory,
                                               const LmRowShare& share, Barrier& barrier,
                                               LmState& state, bool is_there) {
    const uint32_t thread = threadIdx.x;
    float* step = memory.products;  // read by no other block any more
    if (is_there) {
        bool finite = true;
        for (uint32_t i = thread; i < 6 * memory.rows; i += kRowThreads) {
            step[i] = step_entry(memory, i);
            finite &= std::isfinite(step[i]);
        }
        finite = __syncthreads_and(finite);
        if (thread == 0) view.exchange.finite[blockIdx.x] = finite;
        barrier.wait();
        for (uint32_t block = thread; block < gridDim.x; block += kRowThreads)
            finite &= view.exchange.finite[block] != 0;
        finite = __syncthreads_and(finite);
        if (thread == 0) {
            ++state.iterations;
            state.any_step |= finite;
            state.lambda = finite ? lowered(state.lambda) : raised(state.lambda);
        }
        is_there = finite;
        __syncthreads();
    }
    for (uint32_t row = thread; row < memory.rows; row += kRowThreads) {
        const uint32_t node = share.first_node + row;
        const float* own = step + 6 * row;
        NodePose<float> pose = load_pose(view, state.copy, node);
        if (is_there) pose = moved(pose, {own[0], own[1], own[2]}, {own[3], own[4], own[5]});
        give_result(view, state, node, pose);
    }
    if (blockIdx.x == 0 && thread == 0) *view.summary = summarise(view.p, state);
}

// Starts solve: sets the residual and the first direction of all control points that the block
// knows. Independent ones have their solution with it.
__device__ __forceinline__ void start_vectors(const LmView& view, const LmRowMemory& memory,
                                              bool coupled) {
    for (uint32_t i = threadIdx.x; i < 6 * (coupled ? memory.count : memory.rows);
         i += kRowThreads) {
        const float value = view.exchange.starts[6 * memory.known[i / 6] + i % 6];
        if (coupled) memory.residual[i] = memory.direction[i] = value;
        if (i < 6 * memory.rows) memory.solution[i] = coupled ? 0.0f : value;
    }
}

// The step of an iteration from the system in the present copy; a trusted one is taken as well.
template <class Barrier, bool kShared>
__global__ void __launch_bounds__(kRowThreads, 1) lm_gradients(LmView view, uint32_t iteration) {
    __shared__ LmState state;
    const LmRowShare share = view.rows.shares[blockIdx.x];
    const LmRowMemory memory = lm_row_memory<kShared>(view, share);
    const bool coupled = view.p.steps > 0;
    const uint32_t thread = threadIdx.x, first_place = share.first_place;
    Barrier barrier(view.exchange.row_passed);
    const auto load_place = [&](uint32_t copy, uint32_t place, LmBlock& block) {
        load_fours(
            view.exchange.matrix + 36 * (size_t{copy} * view.surface.places + first_place + place),
            block.value);
    };
    // Loaded before it is known which copy is the present one, since steps mostly are accepted: the
    // last threads' diagonal blocks, the others' places.
    const uint32_t likely = iteration % 2, own_row = kRowThreads - 1 - thread;
    const bool has_place = own_row >= memory.rows && thread < memory.places;
    LmBlock block{};
    const auto load_first = [&](uint32_t copy) {
        if (own_row < memory.rows)
            load_diagonal(view, copy, share.first_node + own_row, block.value);
        else if (coupled && has_place)
            load_place(copy, thread, block);
    };
    load_first(likely);
    find_state(view, iteration, state);
    if (blockIdx.x == 0 && thread == 0) view.exchange.states[iteration % 2] = state;
    const bool trusts = view.p.trusts_last_step && iteration + 1 == view.p.iterations;
    if (stopped(state) || (trusts && state.refused)) {
        if (trusts) take_last_step(view, memory, share, barrier, state, false);
        return;
    }
    if (state.copy != likely) load_first(state.copy);
    for (uint32_t row = own_row; row < memory.rows; row += kRowThreads) {
        if (row != own_row) load_diagonal(view, state.copy, share.first_node + row, block.value);
        damp(view, memory, row, share.first_node + row, state.lambda, block.value);
    }
    if (coupled)
        barrier.wait();
    else
        __syncthreads();
    for (uint32_t place = thread; coupled && place < memory.places; place += kRowThreads) {
        if (place != thread || !has_place) load_place(state.copy, place, block);
        condition(block,
                  memory.factors + kFactorRoom * size_t{view.rows.places[first_place + place].row},
                  view.exchange.factors + kFactorRoom * size_t{memory.known[memory.columns[place]]},
                  memory.matrix + 36 * size_t{place});
    }
    start_vectors(view, memory, coupled);
    __syncthreads();
    if (coupled) solve(view, memory, share, barrier);
    if (trusts) {
        take_last_step(view, memory, share, barrier, state, true);
        return;
    }
    for (uint32_t i = thread; i < 6 * memory.rows; i += kRowThreads)
        view.exchange.steps[6 * share.first_node + i] = step_entry(memory, i);
}

}  // namespace
}  // namespace defrec::cuda
