// Watches how the right view lies against the left in time and space: a right view that is taken
// late, and a calibration that has drifted. Both show in the rows where a piece of tissue is seen
// in the two views, which agree in a rectified pair.
#pragma once
#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/tracking/frame/decisions.hpp"
#include "sdk/tracking/frame/frame_output.hpp"
#include "sdk/tracking/frame/rig_estimate.hpp"

namespace defrec {

// A piece of tissue that is seen in both views.
struct RowMatch {
    double x, y;   // in the left view, px from the image's centre
    double step;   // row in the right view less that in the left, px
    double speed;  // of the row in the left view, px per frame; 0 where it is not known
};

// The frame's matches. last_rows: those of the rig's patches in the left view of the frame before,
// empty where there is none; rows: on return this frame's. Throws nothing if rows and matches have
// room for them.
void match_rows(const TemplateData& data, const FrameOutput& output,
                std::span<const float> last_rows, std::vector<float>& rows,
                std::vector<RowMatch>& matches);

class RowMonitor {
  public:
    RowMonitor(uint32_t width, uint32_t height) : width_(width), height_(height) {}

    // One frame's matches, in the order of the frames.
    RigEstimate update(std::span<const RowMatch> matches);
    void reset() { *this = RowMonitor(width_, height_); }

    // Whether the right view was taken at another time in the frame of the last update.
    bool is_late() const { return is_late_; }
    // Whether rows have disagreed by more than stereo bears, over the last frames.
    bool is_out_of_calibration() const {
        return std::hypot(row_error(), distortion_error()) > decisions::RigRows::kMaxRowError;
    }
    // Whether offset, roll and ratio are worth a new map.
    bool wants_correction() const { return row_error() > decisions::RigRows::kCorrectedRowError; }

  private:
    RigEstimate estimate(double lag) const;
    void add_distortion(std::span<const RowMatch> matches, const Eigen::Vector3d& fit);
    // Root mean squares over the image, px, by offset, roll and ratio, and by the distortion; 0
    // where too little was seen.
    double row_error() const;
    double distortion_error() const;

    uint32_t width_, height_;
    // Estimate of the step at the centre, and its growth along x and y: information and information
    // times mean, of a normal distribution.
    Eigen::Matrix3d information_ = Eigen::Matrix3d::Zero();
    Eigen::Vector3d weighted_ = Eigen::Vector3d::Zero();
    double distortion_squares_ = 0, distortion_weighted_ = 0;
    double matches_ = 0;  // behind them, older ones counting less
    bool is_late_ = false;
};

}  // namespace defrec
