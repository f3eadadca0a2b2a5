// Watches how the right view lies against the left in time and space: a right view that is taken
// late, and a calibration that has drifted. Both show in the rows where a piece of tissue is seen
// in the two views, which agree in a rectified pair.
#pragma once
#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/tracking/decisions/rig.hpp"
#include "sdk/tracking/frame/frame_output.hpp"
#include "sdk/tracking/frame/rig_estimate.hpp"
#include "sdk/tracking/monitors/lasting_lag.hpp"

namespace defrec {

// A patch of the rig as it was found in the left view, with its disparity, px; NaN: not found.
struct RigPatch {
    float column, row, disparity;
};

// The frame's matches. last: the rig's patches in the frame before, empty where there is none; now:
// on return this frame's. Throws nothing if now and matches have room for them.
void match_rows(const TemplateData& data, const FrameOutput& output, std::span<const RigPatch> last,
                std::vector<RigPatch>& now, std::vector<RowMatch>& matches);

class RowMonitor {
  public:
    RowMonitor(uint32_t width, uint32_t height) : width_(width), height_(height) {}

    // One frame's matches, in the order of the frames.
    RigEstimate update(std::span<const RowMatch> matches);
    // A frame that is not measured. A lag that lasts is that of this frame as well.
    RigEstimate skip();
    void reset() { *this = RowMonitor(width_, height_); }
    // The frames before the next are of another time.
    void break_off() { lasting_.break_off(); }
    double speed_along_rows() const { return lasting_.speed(); }  // as LastingLag has it

    // Whether the right view was taken at another time in the frame of the last update.
    bool is_late() const { return is_late_; }
    // Whether rows have disagreed by more than stereo bears, over the last frames, or the right
    // view is turned.
    bool is_out_of_calibration() const {
        return row_error() > decisions::RigRows::kMaxRowError ||
               is_turned(decisions::RigRows::kMaxVergence);
    }
    // Whether offset, roll, ratio and vergence are worth a new map.
    bool wants_correction() const {
        return row_error() > decisions::RigRows::kCorrectedRowError ||
               is_turned(decisions::RigRows::kCorrectedVergence);
    }

  private:
    using Values = Eigen::Vector4d;  // offset, along x, along y, vergence

    void take_rows_of_lasting();
    void measure_shared_noise(std::span<const RowMatch> matches, const RowValues& values);
    RigEstimate estimate(double lag) const;
    // Root mean square over the image, px, by offset, roll and ratio; 0 where too little was seen.
    double row_error() const;
    bool is_turned(double least) const;

    uint32_t width_, height_;
    // Estimate of the step at the centre, its growth along x and y, and the vergence: information
    // and information times mean, of a normal distribution.
    Eigen::Matrix4d information_ = Eigen::Matrix4d::Zero();
    Values weighted_ = Values::Zero();
    double matches_ = 0;  // behind them, older ones counting less
    // Products of the residuals of two matches that lie side by side, older ones counting less.
    double products_ = 0, pairs_ = 0;
    LastingLag lasting_;
    bool is_late_ = false;
};

}  // namespace defrec
