// The rig's errors as the frames so far tell them, and what is corrected of them.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/rig/rig.hpp"
#include "sdk/tracking/monitors/disparity_monitor.hpp"
#include "sdk/tracking/monitors/row_monitor.hpp"

namespace defrec {

// Reasons that the rig gives.
constexpr uint32_t kReasonsOfRig = DEFREC_REASON_VIEW_LATE | DEFREC_REASON_CALIBRATION;

// The monitors after a frame.
struct RigState {
    RowMonitor monitor;  // of what is left after the correction
    RigEstimate left;    // its last estimate
    DisparityMonitor disparities;
    std::vector<RigPatch> patches;  // of its last frame; empty: there is no such frame
};

class RigMonitor {
  public:
    // self_calibration: DEFREC_SELF_CALIBRATION_*.
    RigMonitor(uint32_t width, uint32_t height, uint32_t self_calibration);

    bool is_on() const { return is_on_; }
    const RigState& state() const { return state_; }
    // The rig's error that is left, and what is corrected of it.
    RigEstimate estimate() const;
    // DEFREC_REASON_* after the last frame.
    uint32_t reasons() const;

    // Once for each frame, first of all.
    void begin_frame();
    // Whether a frame's disparities say anything.
    enum class Disparities { kCount, kSayNothing };
    // The frame was found. next: begun as state(), after the frame's measurements; left with the
    // state before. Disparities of a view that is late do not count.
    void commit(RigState& next, Disparities disparities);
    // The frame says nothing of disparities, and none of rows for the next. More than once in a
    // frame is once.
    void skip_frame();
    // The frame was followed with depth.
    void end_depth();
    // From the next frame on the template, or only the vertices, are others.
    void forget_template();
    void forget_vertices() { state_.disparities.forget_vertices(); }
    // Frames are missing before the one that begins.
    void begin_anew() {
        state_.disparities.begin_anew();
        state_.monitor.break_off();
    }

    // The correction that is due, in place of the one before; none where the error is small.
    std::optional<Rig::ViewShift> due_correction() const;
    // From the next frame on rows and disparities are others.
    void correct(const Rig::ViewShift& shift);

  private:
    void take_left(const RigEstimate& left);
    void count_frame();

    RigState state_;
    Rig::ViewShift shift_;         // that the right view is corrected by
    double speed_with_depth_ = 0;  // along the rows, px per frame, when depth was last used
    float last_depth_px_ = 0;      // RigEstimate::last_depth_px, by what was known then
    bool is_counted_ = false;      // the frame, by the monitor of disparities
    const bool is_on_, corrects_;
};

}  // namespace defrec
