// See lag_model.hpp.
#include "sdk/predictor/lag_model.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "sdk/predictor/decisions.hpp"

namespace defrec {

using decisions::PredictionGrid;
using decisions::PredictionLearning;

double LagModel::damped(int horizon, double step_s) {
    const double steps = PredictionLearning::kDamping / step_s;
    return steps * (1 - std::exp(-horizon / steps));
}

LagModel::LagModel(int horizon, double step_s)
    : normal_(Eigen::MatrixXd::Zero(PredictionGrid::kLags, PredictionGrid::kLags)),
      right_(Eigen::VectorXd::Zero(PredictionGrid::kLags)),
      prior_(Eigen::VectorXd::Zero(PredictionGrid::kLags)) {
    prior_[0] = damped(horizon, step_s);
    coefficients_ = prior_;
}

void LagModel::forget(double seconds) {
    const double kept = std::exp(-seconds / PredictionLearning::kMemory);
    normal_ *= kept;
    right_ *= kept;
}

void LagModel::learn(const Eigen::Ref<const Eigen::MatrixXd>& motions,
                     const Eigen::Ref<const Eigen::VectorXd>& reached) {
    normal_.selfadjointView<Eigen::Lower>().rankUpdate(motions);
    right_.noalias() += motions * reached;
}

void LagModel::solve() {
    const double mean =
        std::max(normal_.trace() / PredictionGrid::kLags, PredictionLearning::kRest);
    const double weight = PredictionLearning::kPrior * mean;
    Eigen::MatrixXd matrix = normal_;
    matrix.diagonal().array() += weight;
    coefficients_ = matrix.selfadjointView<Eigen::Lower>().ldlt().solve(right_ + weight * prior_);
}

}  // namespace defrec
