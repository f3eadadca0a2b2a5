// A run's words on a calibration that is not that of the cameras any more.
#pragma once

#include <string>

#include "include/defrec_c.h"
#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

class CalibrationDrift {
  public:
    // A frame with DEFREC_REASON_CALIBRATION.
    void add(const StereoFrame& frame, const defrec_result& result);
    // Empty for no frame. frames: of the run; in few of them a view that is late looks alike.
    // may_correct: self_calibration could be asked to.
    std::string note(int frames, bool may_correct) const;
    int frames() const { return frames_; }
    // Frames are tracked, degraded: what the doctor warns of, and no problem.
    bool is_mild() const;

  private:
    double mean_row_error() const;

    int frames_ = 0;
    double row_errors_ = 0;  // px, the sum over the frames
};

}  // namespace defrec::cli
