// Places of points at the time of display, from where they were in the frames until then.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "sdk/predictor/frame_interval.hpp"
#include "sdk/predictor/motion_learner.hpp"

namespace defrec {

// All but xyz may be null.
struct PredictedPoints {
    double* xyz = nullptr;
    uint8_t* status = nullptr;
    double* expected_error_mm = nullptr;
    uint8_t* basis = nullptr;  // DEFREC_PREDICTED_*
};

// One thread.
class Predictor {
  public:
    explicit Predictor(std::size_t points);

    std::size_t point_count() const { return runs_.size(); }
    // Throws Error(DEFREC_ERROR_ARGUMENT), and is as before. Out of memory the motion before is
    // forgotten.
    void add_frame(const FollowedPoints& frame);
    // Throws Error(DEFREC_ERROR_ARGUMENT), Error(DEFREC_ERROR_STATE).
    void predict(int64_t time_ns, const PredictedPoints& out) const;

  private:
    // The last frame as it was given.
    struct LastFrame {
        int64_t time_ns = 0;
        uint32_t epoch = 0;
        std::vector<double> xyz, error_mm;
        std::vector<uint8_t> status;
    };

    void check(const FollowedPoints& frame) const;
    void keep(const FollowedPoints& frame);
    void forget();
    void follow(const FollowedPoints& frame, double seconds);
    double max_motion_mm(double seconds) const;
    void find_lags();
    void forecast();
    double check_time(int64_t time_ns) const;
    void move_on(double steps, const PredictedPoints& out) const;
    double expected_error(std::size_t point, double steps) const;

    LastFrame last_;
    MotionHistory history_;
    PointRuns runs_;
    FrameInterval interval_;
    std::optional<MotionLearner> learner_;  // once there is an interval
    std::deque<Forecast> forecasts_;        // the last is the last frame's, unless it is lost
    int64_t origin_ns_ = 0;                 // time 0 of the history
    bool has_frame_ = false;
};

}  // namespace defrec
