// What a block of stage lm's solver keeps, and where.
#pragma once
#include "backends/cuda/lm_view.hpp"

namespace defrec::cuda {

// The residuals of a chunk, always in shared memory.
constexpr size_t kLmRecordFloats = (kRecord + kConnectionRecord) * kLmChunk;
// All else.
constexpr size_t lm_local_floats(size_t rows, size_t most_known, size_t most_places) {
    const size_t floats = (4 * (kPose + kPresent) + 3 * 6 + 1) * most_known + (kOwn + kOwnFactor) * rows + (36 + 1) * most_places;
    return (floats + 3) / 4 * 4;
}

struct LmMemory {
    float *records, *connection_records;
    float4 *poses, *present;                 // of the control points that it knows
    float *direction, *residual, *solution;  // likewise
    float *own, *own_factors;                // of its own control points
    float* matrix;                           // its places
    uint32_t* columns;                       // likewise
    uint32_t* known;
    uint32_t count;  // of known control points
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
    memory.records = take(kRecord * kLmChunk);
    memory.connection_records = take(kConnectionRecord * kLmChunk);
    if constexpr (!kShared) at = view.exchange.local + blockIdx.x * lm_local_floats(surface.rows, surface.most_known, surface.most_places);
    memory.poses = reinterpret_cast<float4*>(take(4 * kPose * size_t{surface.most_known}));
    memory.present = reinterpret_cast<float4*>(take(4 * kPresent * size_t{surface.most_known}));
    memory.own = take(kOwn * size_t{surface.rows});
    memory.own_factors = take(kOwnFactor * size_t{surface.rows});
    memory.matrix = take(36 * size_t{surface.most_places});
    memory.direction = take(6 * size_t{surface.most_known});
    memory.residual = take(6 * size_t{surface.most_known});
    memory.solution = take(6 * size_t{surface.most_known});
    memory.columns = reinterpret_cast<uint32_t*>(take(surface.most_places));
    memory.known = reinterpret_cast<uint32_t*>(take(surface.most_known));
    memory.count = share.last_known - share.first_known;
    for (uint32_t i = threadIdx.x; i < share.last_place - share.first_place; i += kLmThreads)
        memory.columns[i] = surface.places[share.first_place + i].column;
    for (uint32_t i = threadIdx.x; i < memory.count; i += kLmThreads) memory.known[i] = surface.known[share.first_known + i];
    __syncthreads();
    return memory;
}

__device__ __forceinline__ Vec3<float> vector_of(float4 v) { return {v.x, v.y, v.z}; }
__device__ __forceinline__ Quaternion<float> quaternion_of(float4 q) { return {q.x, q.y, q.z, q.w}; }
__device__ __forceinline__ float4 pack(Vec3<float> v, float w) { return make_float4(v.x, v.y, v.z, w); }
__device__ __forceinline__ float4 pack(Quaternion<float> q) { return make_float4(q.w, q.x, q.y, q.z); }

}  // namespace
}  // namespace defrec::cuda
