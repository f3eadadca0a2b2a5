// A frame's predictions at each step after it.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "sdk/predictor/lag_model.hpp"
#include "sdk/predictor/point_runs.hpp"
#include "sdk/predictor/prediction_errors.hpp"

namespace defrec {

struct Horizon {
    std::array<Basis, kBases> best{};  // by what may be predicted: position, velocity, learned
    Eigen::Matrix3Xd xyz;              // of all points
    Eigen::Matrix3Xd learned;          // of the learning points, where that may be predicted
};

struct Forecast {
    uint64_t frame = 0;  // its number
    double time_s = 0;
    std::vector<Reach> reach;       // per point
    std::vector<Horizon> horizons;  // 1, 2 ... steps after the frame

    Basis basis(std::size_t horizon, std::size_t point) const;
};

// The means by which one horizon is predicted.
struct HorizonModel {
    LagModel learned;
    double damped;  // steps that a damped velocity goes
    PredictionErrors errors;
};

// From the newest frame; learning: indices of points.
void make_forecast(const MotionHistory& history, const PointRuns& runs,
                   const std::vector<HorizonModel>& models,
                   const std::vector<std::size_t>& learning, Forecast& made);

}  // namespace defrec
