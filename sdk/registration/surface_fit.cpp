// See surface_fit.hpp. Point to plane (Chen and Medioni, Object modelling by registration of
// multiple range images, Image and Vision Computing 10, 1992): each point pulls along the normal
// of the nearest place of the model, with the variance that its covariance has along it. Weights
// first follow Geman and McClure's function of a width that shrinks from step to step (graduated
// non-convexity: Blake and Zisserman, Visual Reconstruction, 1987), then Tukey's biweight.
#include "sdk/registration/surface_fit.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "sdk/registration/decisions.hpp"

namespace defrec {

using decisions::SurfaceApproach;
using decisions::SurfaceKernel;

SurfaceFit::SurfaceFit(const SurfaceProblem& problem, const Pose& start, size_t step)
    : pose_(start), matches_(problem, step) {
    matches_.find(problem.model.tree(), pose_);
}

double SurfaceFit::move(const std::vector<double>& weights, double damping, bool is_fine) {
    const SurfaceProblem& problem = *matches_.problem;
    TwistMatrix matrix = TwistMatrix::Zero();
    Twist right = Twist::Zero();
    double sum = 0;
    for (size_t i = 0; i < matches_.all.size(); ++i) {
        if (weights[i] == 0) continue;
        const SurfaceMatch& match = matches_.all[i];
        const double weight = is_fine ? weights[i] / (match.expected * match.expected) : weights[i];
        const Twist row = matches_.gradient(match);
        matrix.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
        right += weight * match.residual * row;
        sum += weight;
    }
    if (sum == 0) return 0;
    matrix.diagonal().array() += damping * sum;
    Twist step = matrix.selfadjointView<Eigen::Lower>().ldlt().solve(right);
    const double length = step.norm();
    if (length > SurfaceApproach::kMaxStep) step *= SurfaceApproach::kMaxStep / length;
    step.head<3>() /= problem.length;
    pose_ = moved(pose_, step, problem.centre);
    matches_.find(problem.model.tree(), pose_);
    return length;
}

void SurfaceFit::approach() {
    std::vector<double> weights(matches_.all.size());
    double width = SurfaceApproach::kFirstWidth;
    const double factor =
        std::pow(SurfaceApproach::kLastWidth / width, 1.0 / (SurfaceApproach::kRounds - 1));
    for (int round = 0; round < SurfaceApproach::kRounds; ++round, width *= factor) {
        for (size_t i = 0; i < weights.size(); ++i) {
            const double ratio = matches_.all[i].residual / width;
            weights[i] =
                matches_.all[i].is_valid ? 1 / ((1 + ratio * ratio) * (1 + ratio * ratio)) : 0;
        }
        move(weights, SurfaceApproach::kDamping, false);
    }
}

double SurfaceFit::wide_cost() const {
    double cost = 0;
    for (const SurfaceMatch& match : matches_.all) {
        const double ratio = match.residual / SurfaceApproach::kLastWidth;
        cost += match.is_valid ? ratio * ratio / (1 + ratio * ratio) : 1;
    }
    return cost / static_cast<double>(matches_.all.size());
}

void SurfaceFit::refine() {
    for (int round = 0; round < SurfaceKernel::kMaxRounds; ++round)
        if (move(matches_.weights(matches_.robust_scale()), SurfaceKernel::kDamping, true) <
            SurfaceKernel::kRest)
            break;
}

}  // namespace defrec
