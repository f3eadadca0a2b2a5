// Poses of control points, and the motions that a run ends with.
#pragma once
#include "backends/cuda/lm_memory.cuh"
#include "backends/cuda/lm_state.cuh"

namespace defrec::cuda {
namespace {

__device__ __forceinline__ float4* pose_at(const LmView& view, uint32_t copy, uint32_t node) {
    return view.exchange.poses + 2 * (size_t{copy} * view.p.nodes + node);
}
__device__ __forceinline__ NodePose<float> load_pose(const LmView& view, uint32_t copy,
                                                     uint32_t node) {
    const float4* from = pose_at(view, copy, node);
    return {quaternion_of(from[0]), vector_of(from[1])};
}
__device__ __forceinline__ void give_pose(const LmView& view, uint32_t copy, uint32_t node,
                                          const NodePose<float>& pose) {
    float4* to = pose_at(view, copy, node);
    to[0] = pack(pose.rotation);
    to[1] = pack(pose.position, 0);
}

__device__ __forceinline__ NodePose<float> moved(const NodePose<float>& pose, Vec3<float> turn,
                                                 Vec3<float> shift) {
    const Quaternion<float> rotation = rotation_from_vector(turn) * pose.rotation;
    return {(1 / std::sqrt(dot(rotation, rotation))) * rotation, pose.position + shift};
}

__device__ __forceinline__ DualQuaternion<float> motion_of(const LmView& view, uint32_t node,
                                                           const NodePose<float>& pose) {
    return from_rigid(pose.rotation,
                      pose.position - rotate(pose.rotation, vector_of(view.surface.rest[node])));
}

// A control point's motion at the end of a run that leaves it in that pose.
__device__ __forceinline__ void give_result(const LmView& view, const LmState& state, uint32_t node,
                                            const NodePose<float>& pose) {
    const auto motion = failed(state) ? usable_motion<float>(view.frame.motions[node])
                                      : motion_of(view, node, pose);
    view.results[node] = motion.store();
}

}  // namespace
}  // namespace defrec::cuda
