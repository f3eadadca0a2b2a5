// Where a block of stage lm's solver keeps what: shared memory as far as it reaches.
#pragma once
#include "backends/cuda/lm_view.hpp"

namespace defrec::cuda {
namespace {

template <class Mode>
struct LmMemory {
    float *records, *connection_records;
    float4 *poses, *present;                   // of all control points
    float *direction, *residual, *solution;    // likewise
    float *own, *own_factors;                  // of the block's control points
    float* matrix;                             // the block's places
    uint32_t* columns;                         // likewise; nullptr: see the surface
    uint32_t first_node, last_node;            // whose vectors the block updates
};

template <class Mode>
__device__ __forceinline__ LmMemory<Mode> lm_memory(const LmView& view, const LmShare& share) {
    const size_t nodes = view.p.nodes, rows = view.surface.rows;
    LmMemory<Mode> memory{};
    float* at = dynamic_shared<float>();
    const auto take = [&at](size_t floats) {
        float* taken = at;
        at += floats;
        return taken;
    };
    memory.records = take(kRecord * kLmChunk);
    memory.connection_records = take(kConnectionRecord * kLmChunk);
    if constexpr (Mode::kReplicated) {
        memory.poses = reinterpret_cast<float4*>(take(4 * kPose * nodes));
        memory.present = reinterpret_cast<float4*>(take(4 * kPresent * nodes));
        memory.own = take(kOwn * rows);
        memory.own_factors = take(kOwnFactor * rows);
        memory.direction = take(6 * nodes);
        memory.residual = take(6 * nodes);
        memory.solution = take(6 * nodes);
        memory.first_node = 0;
        memory.last_node = view.p.nodes;
    } else {
        memory.poses = view.exchange.poses;
        memory.present = view.exchange.present;
        memory.own = view.exchange.own + kOwn * size_t{share.first_node};
        memory.own_factors = view.exchange.own_factors + kOwnFactor * size_t{share.first_node};
        memory.direction = view.exchange.vectors;
        memory.residual = memory.direction + 6 * nodes;
        memory.solution = memory.residual + 6 * nodes;
        memory.first_node = share.first_node;
        memory.last_node = share.last_node;
    }
    if constexpr (Mode::kMatrix) {
        memory.matrix = take(36 * size_t{view.surface.most_places});
        memory.columns = reinterpret_cast<uint32_t*>(take(view.surface.most_places));
    } else {
        memory.matrix = view.exchange.matrix + 36 * size_t{share.first_place};
    }
    return memory;
}

// After writing poses or vectors.
template <class Mode>
__device__ __forceinline__ void sync_nodes() {
    if constexpr (Mode::kReplicated)
        __syncthreads();
    else
        sync_grid();
}

__device__ __forceinline__ Vec3<float> vector_of(float4 v) { return {v.x, v.y, v.z}; }
__device__ __forceinline__ Quaternion<float> quaternion_of(float4 q) { return {q.x, q.y, q.z, q.w}; }
__device__ __forceinline__ float4 pack(Vec3<float> v, float w) { return make_float4(v.x, v.y, v.z, w); }
__device__ __forceinline__ float4 pack(Quaternion<float> q) { return make_float4(q.w, q.x, q.y, q.z); }

}  // namespace
}  // namespace defrec::cuda
