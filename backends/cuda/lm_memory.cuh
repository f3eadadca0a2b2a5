// What a block of stage lm that evaluates residuals keeps, and where.
#pragma once
#include "backends/cuda/lm_view.hpp"

namespace defrec::cuda {

constexpr size_t lm_term_floats(size_t terms) { return (terms + 7) / 8 * 4; }
// What a chunk needs, always in shared memory.
constexpr size_t lm_chunk_floats(const LmPlan& plan) {
    return 4 * kRecord * size_t{plan.max_items} + kConnectionRecord * size_t{plan.max_connections} +
           lm_term_floats(plan.max_terms);
}
// All else, as lm_memory takes it.
constexpr size_t lm_local_floats(const LmPlan& plan) {
    const size_t floats = (4 * kPose + 1) * size_t{plan.max_known} + kOwn * size_t{plan.rows} +
                          36 * size_t{plan.max_places} +
                          sizeof(LmSum) / sizeof(float) * plan.max_sums;
    return (floats + 3) / 4 * 4;
}

struct LmMemory {
    float4* records;  // of the chunk's items, kRecord each
    float* connection_records;
    uint16_t* terms;
    float4* poses;  // of the control points that it knows
    float* own;     // of its own control points
    float* matrix;  // its places
    uint32_t* known;
    LmSum* sums;                // of the chunk
    uint32_t count;             // of known control points
    uint32_t connection_slots;  // of connection_records
};

namespace {

// kShared: everything is in shared memory.
template <bool kShared>
__device__ __forceinline__ LmMemory lm_memory(const LmView& view, const LmShare& share) {
    const LmSurface& surface = view.surface;
    LmMemory memory{};
    float* at = dynamic_shared<float>();
    const auto take = [&at](size_t floats) {
        float* taken = at;
        at += floats;
        return taken;
    };
    memory.records = reinterpret_cast<float4*>(take(4 * kRecord * size_t{surface.max_items}));
    memory.terms = reinterpret_cast<uint16_t*>(take(lm_term_floats(surface.max_terms)));
    memory.connection_records = take(kConnectionRecord * size_t{surface.max_connections});
    if constexpr (!kShared) at = view.exchange.local + blockIdx.x * view.exchange.local_floats;
    memory.poses = reinterpret_cast<float4*>(take(4 * kPose * size_t{surface.max_known}));
    memory.own = take(kOwn * size_t{surface.rows});
    memory.matrix = take(36 * size_t{surface.max_places});
    memory.known = reinterpret_cast<uint32_t*>(take(surface.max_known));
    memory.sums = reinterpret_cast<LmSum*>(take(0));
    memory.count = share.last_known - share.first_known;
    memory.connection_slots = surface.max_connections;
    for (uint32_t i = threadIdx.x; i < memory.count; i += kLmThreads)
        memory.known[i] = surface.known[share.first_known + i];
    __syncthreads();
    return memory;
}

__device__ __forceinline__ Vec3<float> vector_of(float4 v) { return {v.x, v.y, v.z}; }
__device__ __forceinline__ Quaternion<float> quaternion_of(float4 q) {
    return {q.x, q.y, q.z, q.w};
}
__device__ __forceinline__ float4 pack(Vec3<float> v, float w) {
    return make_float4(v.x, v.y, v.z, w);
}
__device__ __forceinline__ float4 pack(Quaternion<float> q) {
    return make_float4(q.w, q.x, q.y, q.z);
}

}  // namespace
}  // namespace defrec::cuda
