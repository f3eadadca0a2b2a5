// Learns from each frame how points move, and how wrong what was predicted for it is.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <vector>

#include "sdk/predictor/forecast.hpp"

namespace defrec {

class MotionLearner {
  public:
    MotionLearner(std::size_t points, std::size_t horizons, double step_s);

    // From the newest frame, and what frames before predicted. seconds: since the frame before.
    void add(const MotionHistory& history, const PointRuns& runs,
             const std::deque<Forecast>& forecasts, double seconds);

    const std::vector<HorizonModel>& models() const { return models_; }
    const std::vector<std::size_t>& points() const { return points_; }

  private:
    // A forecast whose time at some horizon has come, and where points are then.
    struct Due {
        const Forecast& made;
        std::size_t horizon;
        Taps now;
    };
    void judge(const MotionHistory& history, const PointRuns& runs, const Due& due, double seconds);
    void compare(const MotionHistory& history, const PointRuns& runs, const Due& due,
                 double seconds);
    void learn(const MotionHistory& history, const PointRuns& runs, const Due& due);

    double step_s_;
    std::vector<std::size_t> points_;  // from which is learned
    std::vector<HorizonModel> models_;
    std::vector<uint64_t> due_;  // per horizon: number of the last frame that was judged
    Eigen::MatrixXd motions_;    // see LagModel
    Eigen::VectorXd reached_;
};

}  // namespace defrec
