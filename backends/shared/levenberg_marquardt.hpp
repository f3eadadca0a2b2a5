// The minimiser of stage lm (docs/stages/lm.md): steps, damping, when to stop. What it minimises is
// a Problem of the backend's own.
#pragma once
#include <cmath>
#include <span>

#include "backends/shared/lm_arap.hpp"
#include "backends/shared/stage.hpp"

namespace defrec {

// Cost by term, and what the summary says of the data.
struct LmSums {
    struct Term {
        double cost = 0, weights = 0,
               squares = 0;  // squares: of the residuals, by the same weights
        int32_t count = 0;   // residuals with weight > 0
        double rms() const { return weights > 0 ? std::sqrt(squares / weights) : 0; }
    };
    Term icp, match, patch;
    double arap = 0;
    double missing =
        0;  // cost of the points without a live surface: what one too far from it costs

    double present() const { return icp.cost + match.cost + patch.cost + arap; }
    double total() const { return present() + missing; }
    bool any_data() const { return icp.count + match.count + patch.count > 0; }
};

inline NodePose<double> moved(const NodePose<double>& pose, const double step[6]) {
    const Quaternion<double> turn = rotation_from_vector(Vec3<double>{step[0], step[1], step[2]});
    const Quaternion<double> rotation = turn * pose.rotation;
    return {(1 / std::sqrt(dot(rotation, rotation))) * rotation,
            pose.position + Vec3<double>{step[3], step[4], step[5]}};
}

// body(i) for all i < count on the host's threads, some at a time.
template <class Body>
void for_each_item(const Host& host, size_t count, Body&& body) {
    constexpr size_t kAtOnce = 64;
    host.parallel_for((count + kAtOnce - 1) / kAtOnce, [&](size_t task) {
        for (size_t i = task * kAtOnce; i < std::min(count, (task + 1) * kAtOnce); ++i) body(i);
    });
}

// The costs, counts and sizes of residuals where the minimiser ends.
inline void summarise(const LmSums& sums, defrec_lm_summary& summary) {
    summary.final_cost = float(sums.total());
    summary.icp_cost = float(sums.icp.cost);
    summary.match_cost = float(sums.match.cost);
    summary.patch_cost = float(sums.patch.cost);
    summary.arap_cost = float(sums.arap);
    summary.icp_points = sums.icp.count;
    summary.matches = sums.match.count;
    summary.patches = sums.patch.count;
    summary.icp_rms = float(sums.icp.rms());
    summary.match_rms = float(sums.match.rms());
    summary.patch_rms = float(sums.patch.rms());
}

// nodes: in, where to start; out, the minimum. trial: as many; step: 6 each. Problem has
// - LmSums begin(nodes): linearises, and fixes what depends on the start; the system becomes the
//   present one
// - LmSums evaluate(nodes, linearise): the cost there, and if wanted its system
// - void accept(): the system last linearised becomes the present one
// - bool solve(lambda, step): of the present one; false if there is no finite solution
template <class Problem>
defrec_lm_summary levenberg_marquardt(Problem& problem, const defrec_lm_params& params,
                                      const Host& host, std::span<NodePose<double>> nodes,
                                      std::span<NodePose<double>> trial, std::span<double> step) {
    defrec_lm_summary summary{};
    LmSums sums = problem.begin(nodes);
    summary.initial_cost = float(sums.total());
    summary.failed = std::isfinite(sums.total()) ? 0 : 1;
    double lambda = double(params.damping);
    bool any_step = false, converged = !sums.any_data(), accepted = true;

    for (uint32_t i = 0; i < params.iterations && !converged && !summary.failed; ++i) {
        const bool trusts = params.trust_last_step != 0 && i + 1 == params.iterations;
        if (trusts && !accepted) break;
        ++summary.iterations;
        accepted = false;
        if (problem.solve(lambda, step.data())) {
            any_step = true;
            for_each_item(host, nodes.size(), [&](size_t k) {
                double* s = &step[6 * k];
                trial[k] = moved(nodes[k], s);
                const double turn = double(params.node_spacing_mm) *
                                    double(params.node_spacing_mm) *
                                    (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
                s[0] = std::max(turn, s[3] * s[3] + s[4] * s[4] + s[5] * s[5]);
            });
            double largest = 0;
            for (size_t k = 0; k < nodes.size(); ++k) largest = std::max(largest, step[6 * k]);
            converged = largest < kMinStepMm * kMinStepMm;
            accepted = trusts;
            if (!trusts) {
                const LmSums there =
                    problem.evaluate(trial, i + 1 < params.iterations && !converged);
                accepted = there.total() < sums.total();
                if (accepted) {
                    converged =
                        converged || sums.total() - there.total() < kMinDecrease * there.present();
                    problem.accept();
                    sums = there;
                }
            }
            if (accepted) std::copy(trial.begin(), trial.end(), nodes.begin());
        }
        lambda = std::clamp(lambda * (accepted ? kLambdaDown : kLambdaUp), kMinLambda, kMaxLambda);
    }
    if (summary.iterations > 0 && !any_step) summary.failed = 1;
    summarise(sums, summary);
    summary.damping = float(lambda);
    return summary;
}

}  // namespace defrec
