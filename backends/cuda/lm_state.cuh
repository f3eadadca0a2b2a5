// The minimiser's decisions (levenberg_marquardt.hpp). Every block that asks comes to the same by
// itself.
#pragma once
#include "backends/cuda/lm_sums.cuh"
#include "backends/shared/levenberg_marquardt.hpp"

namespace defrec::cuda {
namespace {

__device__ __forceinline__ bool stopped(const LmState& state) {
    return state.converged || state.failed;
}

__device__ __forceinline__ double missing_cost(const LmParameters& p) {
    return double(p.icp_weight) * double(p.icp_tukey) * double(p.icp_tukey) / 3;
}
__device__ __forceinline__ double present_cost(const double (&sums)[kSums]) {
    return sums[kIcp] + sums[kMatch] + sums[kPatch] + sums[kArap];
}

__device__ __forceinline__ float lowered(float lambda) {
    return fmaxf(lambda * float(kLambdaDown), float(kMinLambda));
}
__device__ __forceinline__ float raised(float lambda) {
    return fminf(lambda * float(kLambdaUp), float(kMaxLambda));
}

__device__ __forceinline__ void begin_state(const LmParameters& p, const double (&there)[kSums],
                                            LmState& state) {
    for (uint32_t i = 0; i < kSums; ++i) state.sums[i] = there[i];
    state.initial_cost = present_cost(there) + there[kWithoutSurface] * missing_cost(p);
    state.lambda = p.damping;
    state.iterations = 0;
    state.copy = 0;
    state.any_step = state.refused = false;
    state.converged = !(there[kCounts] + there[kCounts + 1] + there[kCounts + 2] > 0);
    state.failed = !std::isfinite(state.initial_cost);
}

// After a step to `there`.
__device__ __forceinline__ void classify(const LmParameters& p, const double (&there)[kSums],
                                         LmState& state) {
    ++state.iterations;
    bool accepted = false;
    if (std::isfinite(there[kFarthest])) {
        state.any_step = true;
        state.converged = there[kFarthest] < kMinStepMm * kMinStepMm;
        const double cost = present_cost(there);
        const double decrease =
            present_cost(state.sums) - cost +
            (state.sums[kWithoutSurface] - there[kWithoutSurface]) * missing_cost(p);
        accepted = decrease > 0;
        if (accepted) {
            state.copy ^= 1;
            if (decrease < kMinDecrease * cost) state.converged = true;
            for (uint32_t i = 0; i < kSums; ++i) state.sums[i] = there[i];
        }
    }
    state.refused = !accepted;
    state.lambda = accepted ? lowered(state.lambda) : raised(state.lambda);
}

// Where the solver stands before iteration `iteration`, after what the kernel before has evaluated.
__device__ __forceinline__ void find_state(const LmView& view, uint32_t iteration, LmState& state) {
    __shared__ double there[kSums];
    LmState before{};
    if (threadIdx.x == 0 && iteration > 0) before = view.exchange.states[(iteration - 1) % 2];
    collect_sums(view.exchange.sums, view.surface.blocks, there);
    if (threadIdx.x == 0) {
        state = before;
        if (iteration == 0)
            begin_state(view.p, there, state);
        else if (!stopped(state))
            classify(view.p, there, state);
    }
    __syncthreads();
}

__device__ __forceinline__ bool failed(const LmState& state) {
    return state.failed || (state.iterations > 0 && !state.any_step);
}

__device__ __forceinline__ defrec_lm_summary summarise(const LmParameters& p,
                                                       const LmState& state) {
    const auto rms = [&state](uint32_t term) {
        const double weights = state.sums[kWeights + term];
        return weights > 0 ? float(std::sqrt(state.sums[kResidualSquares + term] / weights)) : 0.0f;
    };
    defrec_lm_summary summary{};
    summary.initial_cost = float(state.initial_cost);
    summary.final_cost =
        float(present_cost(state.sums) + state.sums[kWithoutSurface] * missing_cost(p));
    summary.icp_cost = float(state.sums[kIcp]);
    summary.match_cost = float(state.sums[kMatch]);
    summary.patch_cost = float(state.sums[kPatch]);
    summary.arap_cost = float(state.sums[kArap]);
    summary.iterations = state.iterations;
    summary.icp_points = static_cast<int32_t>(state.sums[kCounts]);
    summary.matches = static_cast<int32_t>(state.sums[kCounts + 1]);
    summary.patches = static_cast<int32_t>(state.sums[kCounts + 2]);
    summary.icp_rms = rms(kIcp);
    summary.match_rms = rms(kMatch);
    summary.patch_rms = rms(kPatch);
    summary.damping = state.lambda;
    summary.failed = failed(state) ? 1 : 0;
    return summary;
}

}  // namespace
}  // namespace defrec::cuda
