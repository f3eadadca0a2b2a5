// The whole of stage lm but for the rigid motion before it, as one kernel whose blocks all run at
// once. docs/stages/lm.md.
#pragma once
#include "backends/cuda/lm_gradients.cuh"
#include "backends/cuda/lm_linearise.cuh"
#include "backends/cuda/lm_state.cuh"

namespace defrec::cuda {
namespace {

__device__ __forceinline__ void set_pose(const LmView& view, const LmMemory& memory, uint32_t node,
                                         const NodePose<float>& pose) {
    const auto motion = from_rigid(
        pose.rotation,
        pose.position - rotate(pose.rotation, vector_of(view.surface.rest[memory.known[node]])));
    memory.poses[kPose * node] = pack(motion.real);
    memory.poses[kPose * node + 1] = pack(motion.dual);
    memory.poses[kPose * node + 2] = pack(pose.position, 0);
}

// The trial poses become the present ones.
__device__ __forceinline__ void keep_poses(const LmMemory& memory) {
    for (uint32_t i = threadIdx.x; i < memory.count; i += kLmThreads) {
        memory.present[kPresent * i] = memory.poses[kPose * i];
        memory.present[kPresent * i + 1] = memory.poses[kPose * i + 2];
    }
}
__device__ __forceinline__ NodePose<float> present_pose(const LmMemory& memory, uint32_t node) {
    return {quaternion_of(memory.present[kPresent * node]),
            vector_of(memory.present[kPresent * node + 1])};
}
// And the other way round.
__device__ __forceinline__ void restore_poses(const LmView& view, const LmMemory& memory) {
    for (uint32_t i = threadIdx.x; i < memory.count; i += kLmThreads)
        set_pose(view, memory, i, present_pose(memory, i));
    __syncthreads();
}

__device__ __forceinline__ void start_poses(const LmView& view, const LmMemory& memory) {
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
    }
    keep_poses(memory);
    __syncthreads();
}

// From the present poses by the solution to the trial. Returns kFarthest's part.
__device__ __forceinline__ float move(const LmView& view, const LmMemory& memory,
                                      const LmShare& share, uint32_t copy) {
    const float* factors = view.exchange.factors + size_t{copy} * kFactor * view.p.nodes;
    float farthest = 0;
    for (uint32_t i = threadIdx.x; i < memory.count; i += kLmThreads) {
        float step[6] = {};
        for (uint32_t r = 0, at = 0; r < 6; ++r) {
            const float value = memory.solution[6 * i + r];
            for (uint32_t c = 0; c <= r; ++c, ++at)
                step[c] =
                    fmaf(factors[size_t{at} * view.p.nodes + memory.known[i]], value, step[c]);
        }
        const Vec3<float> turn{step[0], step[1], step[2]}, shift{step[3], step[4], step[5]};
        const float turned = view.p.spacing2 * dot(turn, turn), shifted = dot(shift, shift),
                    longest = fmaxf(turned, shifted);
        const bool good = std::isfinite(turned) && std::isfinite(shifted);
        NodePose<float> pose = present_pose(memory, i);
        if (good) {
            const Quaternion<float> rotation = rotation_from_vector(turn) * pose.rotation;
            pose = {(1 / std::sqrt(dot(rotation, rotation))) * rotation, pose.position + shift};
        }
        set_pose(view, memory, i, pose);
        if (i < share.last_node - share.first_node)
            farthest = fmaxf(farthest, good ? longest : __uint_as_float(0x7f800000));
    }
    __syncthreads();
    return farthest;
}

__device__ __forceinline__ void give_results(const LmView& view, const LmMemory& memory,
                                             const LmShare& share, const LmState& state) {
    const bool failed = state.failed || (state.iterations > 0 && !state.any_step);
    for (uint32_t i = threadIdx.x; i < share.last_node - share.first_node; i += kLmThreads) {
        const uint32_t node = share.first_node + i;
        auto motion = usable_motion<float>(view.frame.motions[node]);
        if (!failed) {
            const NodePose<float> pose = present_pose(memory, i);
            motion = from_rigid(
                pose.rotation,
                pose.position - rotate(pose.rotation, vector_of(view.surface.rest[node])));
        }
        view.results[node] = motion.store();
    }
    if (blockIdx.x == 0 && threadIdx.x == 0) *view.summary = summarise(view.p, state, failed);
}

// Registers for three blocks on a multiprocessor, so that as many trackers' solves run beside each
// other.
template <bool kShared>
__global__ void __launch_bounds__(kLmThreads, kShared ? 4 : 1) lm_solve(LmView view) {
    __shared__ LmState state;
    __shared__ double there[kSums];
    const LmShare share = view.surface.shares[blockIdx.x];
    const LmMemory memory = lm_memory<kShared>(view, share);
    const uint32_t thread = threadIdx.x, iterations = view.p.iterations;
    uint32_t copy = 0;
    LmLoaded loaded{~0u, 0};
    GridBarrier barrier(view.exchange.passed);
    const auto collect = [&] {
        barrier.wait();
        collect_sums(view.exchange.sums + size_t{copy} * gridDim.x * kSums, there);
    };
    start_poses(view, memory);
    for (uint32_t i = 0; i <= iterations && (i == 0 || !stopped(state)); ++i) {
        float farthest = 0, lambda = view.p.damping;
        if (i > 0) {
            solve(view, memory, share, copy, barrier);
            farthest = move(view, memory, share, copy);
            lambda = lowered(state.lambda);  // as if it were accepted, which it almost always is
        }
#pragma unroll 1
        for (bool goes_back = false;; goes_back = true) {
            copy ^= 1;
            evaluate(view, memory, share, i == 0, i < iterations, lambda, farthest, copy, loaded,
                     barrier);
            collect();
            if (goes_back) break;
            if (thread == 0) {
                if (i == 0)
                    begin_state(view.p, there, state);
                else
                    classify(view.p, there, state);
            }
            __syncthreads();
            if (state.accepted) keep_poses(memory);
            if (i == 0 || state.accepted || i == iterations || stopped(state)) break;
            restore_poses(view, memory);
            farthest = 0;
            lambda = state.lambda;
        }
        __syncthreads();
    }
    give_results(view, memory, share, state);
}

}  // namespace
}  // namespace defrec::cuda
