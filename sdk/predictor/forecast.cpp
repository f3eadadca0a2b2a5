// See forecast.hpp.
#include "sdk/predictor/forecast.hpp"

#include <algorithm>

#include "sdk/predictor/decisions.hpp"

namespace defrec {
namespace {

using decisions::PredictionGrid;

// Points of a block: their positions in all frames of the lags stay in the second cache.
constexpr Eigen::Index kBlock = 512;

// A prediction as a sum of positions in the frames from a number on.
struct FrameWeights {
    uint64_t first = 0;
    std::vector<double> values;

    void add(const Taps& taps, double weight) {
        for (std::size_t i = 0; i < taps.count; ++i)
            values[taps.first + i - first] += weight * taps.weights[i];
    }
};

FrameWeights learned_weights(const MotionHistory& history, const Eigen::VectorXd& coefficients) {
    const MotionFrame& frame = history.at(history.newest());
    const std::vector<Taps>& lags = frame.lags;
    FrameWeights weights{frame.lags_from, {}};
    weights.values.resize(history.newest() - weights.first + 1);
    weights.add(lags[0], 1);
    for (std::size_t lag = 0; lag + 1 < lags.size(); ++lag) {
        const double coefficient = coefficients[static_cast<Eigen::Index>(lag)];
        weights.add(lags[lag], coefficient);
        weights.add(lags[lag + 1], -coefficient);
    }
    return weights;
}

void add_weighted(const MotionHistory& history, const FrameWeights& weights,
                  Eigen::Matrix3Xd& sum) {
    sum.setZero();
    for (Eigen::Index begin = 0; begin < sum.cols(); begin += kBlock) {
        const Eigen::Index count = std::min(kBlock, sum.cols() - begin);
        for (std::size_t i = 0; i < weights.values.size(); ++i)
            if (weights.values[i] != 0)
                sum.middleCols(begin, count) +=
                    weights.values[i] * history.at(weights.first + i).xyz.middleCols(begin, count);
    }
}

Eigen::Vector3d weighted(const MotionHistory& history, const FrameWeights& weights,
                         Eigen::Index point) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < weights.values.size(); ++i)
        sum += weights.values[i] * history.at(weights.first + i).xyz.col(point);
    return sum;
}

// Fills in the points whose prediction is not learned.
void predict_simply(const MotionHistory& history, double damped, const Forecast& made,
                    std::size_t horizon, Eigen::Matrix3Xd& xyz) {
    const MotionFrame& frame = history.at(history.newest());
    for (std::size_t point = 0; point < made.reach.size(); ++point) {
        const Basis basis = made.basis(horizon, point);
        if (basis == Basis::kLearned) continue;
        const auto column = static_cast<Eigen::Index>(point);
        xyz.col(column) = frame.xyz.col(column);
        if (basis == Basis::kVelocity)
            xyz.col(column) +=
                damped * (frame.xyz.col(column) - history.position(frame.lags[1], column));
    }
}

}  // namespace

Basis Forecast::basis(std::size_t horizon, std::size_t point) const {
    const auto reached = static_cast<std::size_t>(reach[point]);
    return reached == 0 ? Basis::kLast : horizons[horizon].best[reached - 1];
}

void make_forecast(const MotionHistory& history, const PointRuns& runs,
                   const std::vector<HorizonModel>& models,
                   const std::vector<std::size_t>& learning, Forecast& made) {
    const MotionFrame& frame = history.at(history.newest());
    made.frame = history.newest();
    made.time_s = frame.time_s;
    made.reach.resize(runs.size());
    for (std::size_t point = 0; point < runs.size(); ++point)
        made.reach[point] = runs.reach(point, frame);
    const bool is_whole = frame.lags.size() > PredictionGrid::kLags;
    made.horizons.resize(models.size());
    for (std::size_t i = 0; i < models.size(); ++i) {
        Horizon& horizon = made.horizons[i];
        for (std::size_t basis = 0; basis < kBases; ++basis)
            horizon.best[basis] = models[i].errors.best(static_cast<Basis>(basis));
        horizon.xyz.resize(3, frame.xyz.cols());
        horizon.learned.resize(3, static_cast<Eigen::Index>(learning.size()));
        if (is_whole) {
            const FrameWeights weights = learned_weights(history, models[i].learned.coefficients());
            for (std::size_t j = 0; j < learning.size(); ++j)
                horizon.learned.col(static_cast<Eigen::Index>(j)) =
                    weighted(history, weights, static_cast<Eigen::Index>(learning[j]));
            if (horizon.best.back() == Basis::kLearned) add_weighted(history, weights, horizon.xyz);
        }
        predict_simply(history, models[i].damped, made, i, horizon.xyz);
    }
}

}  // namespace defrec
