// See rig_monitor.hpp.
#include "sdk/tracking/monitors/rig_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sdk/tracking/decisions/rig.hpp"

namespace defrec {

RigMonitor::RigMonitor(uint32_t width, uint32_t height, uint32_t self_calibration)
    : state_{RowMonitor(width, height), {}, {}, {}},
      is_on_(self_calibration != DEFREC_SELF_CALIBRATION_OFF),
      corrects_(self_calibration == DEFREC_SELF_CALIBRATION_CORRECT) {}

RigEstimate RigMonitor::estimate() const {
    RigEstimate all = state_.left;
    all.vertical_offset_px += static_cast<float>(shift_.offset_px);
    all.roll_deg += static_cast<float>(shift_.roll * 180 / std::numbers::pi);
    all.focal_ratio += static_cast<float>(shift_.ratio);
    all.vergence += static_cast<float>(shift_.vergence);
    return all;
}

uint32_t RigMonitor::reasons() const {
    const bool is_misaligned =
        state_.monitor.is_out_of_calibration() || state_.disparities.baseline_drift_px() != 0;
    uint32_t reasons = 0;
    if (state_.monitor.is_late()) reasons |= DEFREC_REASON_VIEW_LATE;
    if (is_misaligned) reasons |= DEFREC_REASON_CALIBRATION;
    return reasons;
}

void RigMonitor::begin_frame() {
    is_counted_ = false;
    take_left(state_.monitor.skip());
}

// With what the frame's rows do not tell.
void RigMonitor::take_left(const RigEstimate& left) {
    state_.left = left;
    // It is repeated until less than that is left: a standard deviation of what is left by it.
    if (shift_.vergence != 0)
        state_.left.corrected_sigma =
            static_cast<float>(decisions::RigRows::kCorrectedVergence / std::numbers::sqrt3);
    // A lag that is told now may have been there then.
    state_.left.last_depth_px =
        std::max(last_depth_px_, static_cast<float>(std::abs(left.lag_frames * speed_with_depth_)));
}

void RigMonitor::commit(RigState& next, Disparities disparities) {
    state_.monitor = next.monitor;
    take_left(next.left);
    state_.patches.swap(next.patches);
    if (disparities == Disparities::kCount && !state_.monitor.is_late()) {
        std::swap(state_.disparities, next.disparities);
        is_counted_ = true;
    } else {
        count_frame();
    }
}

void RigMonitor::skip_frame() {
    state_.patches.clear();
    count_frame();
}

void RigMonitor::count_frame() {
    if (!std::exchange(is_counted_, true)) state_.disparities.skip_frame();
}

void RigMonitor::end_depth() {
    speed_with_depth_ = state_.monitor.speed_along_rows();
    last_depth_px_ = std::hypot(state_.left.lag_frames, state_.left.unseen_lag_frames) *
                     static_cast<float>(std::abs(speed_with_depth_));
}

void RigMonitor::forget_template() {
    state_.patches.clear();
    state_.disparities.reset();
}

std::optional<Rig::ViewShift> RigMonitor::due_correction() const {
    if (!corrects_ || !state_.monitor.wants_correction()) return std::nullopt;
    Rig::ViewShift shift = shift_;
    shift.offset_px += state_.left.vertical_offset_px;
    shift.roll += state_.left.roll_deg * std::numbers::pi / 180;
    shift.ratio += state_.left.focal_ratio - 1;
    shift.vergence += state_.left.vergence;
    return shift;
}

void RigMonitor::correct(const Rig::ViewShift& shift) {
    shift_ = shift;
    state_.monitor.reset();
    state_.disparities.begin_anew();
    state_.patches.clear();
}

}  // namespace defrec
