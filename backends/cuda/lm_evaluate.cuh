// The kernels of stage lm that evaluate residuals: where the run begins, and where a step leads;
// and the one that ends it. docs/stages/lm.md.
#pragma once
#include "backends/cuda/lm_linearise.cuh"
#include "backends/cuda/lm_poses.cuh"

namespace defrec::cuda {
namespace {

__device__ __forceinline__ void set_pose(const LmView& view, const LmMemory& memory, uint32_t i,
                                         const NodePose<float>& pose) {
    const auto motion = motion_of(view, memory.known[i], pose);
    memory.poses[kPose * i] = pack(motion.real);
    memory.poses[kPose * i + 1] = pack(motion.dual);
    memory.poses[kPose * i + 2] = pack(pose.position, 0);
}

// Registers for four blocks on a multiprocessor, so that as many trackers' solves run beside each
// other.
template <bool kShared>
__global__ void __launch_bounds__(kLmThreads, kShared ? 4 : 1) lm_begin(LmView view) {
    const LmShare share = view.surface.shares[blockIdx.x];
    const LmMemory memory = lm_memory<kShared>(view, share);
    for (uint32_t i = threadIdx.x; i < memory.count; i += kLmThreads) {
        const auto motion = usable_motion<float>(view.frame.motions[memory.known[i]]);
        NodePose<float> pose{motion.real,
                             apply(motion, vector_of(view.surface.rest[memory.known[i]]))};
        if (view.frame.rigid != nullptr) {
            const Quaternion<float> turn = quaternion_of(view.frame.rigid[0]);
            pose = {turn * pose.rotation,
                    rotate(turn, pose.position) + vector_of(view.frame.rigid[1])};
        }
        set_pose(view, memory, i, pose);
        if (i < share.last_node - share.first_node) give_pose(view, 0, share.first_node + i, pose);
    }
    __syncthreads();
    evaluate<true>(view, memory, share, true, 0, 0);
}

// From the present poses by the step to the others.
template <bool kShared>
__global__ void __launch_bounds__(kLmThreads, kShared ? 4 : 1)
    lm_step(LmView view, uint32_t iteration) {
    const LmState& state = view.exchange.states[iteration % 2];
    const LmShare share = view.surface.shares[blockIdx.x];
    const LmMemory memory = lm_memory<kShared>(view, share);
    if (stopped(state)) return;
    const uint32_t present = state.copy;
    float farthest = 0;
    for (uint32_t i = threadIdx.x; i < memory.count; i += kLmThreads) {
        const uint32_t node = memory.known[i];
        const float* step = view.exchange.steps + 6 * size_t{node};
        const Vec3<float> turn{step[0], step[1], step[2]}, shift{step[3], step[4], step[5]};
        const float turned = view.p.spacing2 * dot(turn, turn), shifted = dot(shift, shift),
                    longest = fmaxf(turned, shifted);
        const bool good = std::isfinite(turned) && std::isfinite(shifted);
        NodePose<float> pose = load_pose(view, present, node);
        if (good) pose = moved(pose, turn, shift);
        set_pose(view, memory, i, pose);
        if (i < share.last_node - share.first_node) {
            give_pose(view, 1 - present, node, pose);
            farthest = fmaxf(farthest, good ? longest : __uint_as_float(0x7f800000));
        }
    }
    __syncthreads();
    evaluate<false>(view, memory, share, iteration + 1 < view.p.iterations, farthest, 1 - present);
}

__global__ void __launch_bounds__(kLmThreads) lm_finish(LmView view) {
    __shared__ LmState state;
    find_state(view, view.p.iterations, state);
    const uint32_t node = blockIdx.x * kLmThreads + threadIdx.x;
    if (node < view.p.nodes) give_result(view, state, node, load_pose(view, state.copy, node));
    if (node == 0) *view.summary = summarise(view.p, state);
}

}  // namespace
}  // namespace defrec::cuda
