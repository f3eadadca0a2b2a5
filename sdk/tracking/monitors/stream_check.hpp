// What is wrong with a stream of frames, from each frame's images and time alone.
#pragma once
#include <cstdint>

#include "sdk/tracking/monitors/frame_state.hpp"

namespace defrec {

// Reasons of images in which there is nothing to observe.
inline constexpr uint32_t kUselessImages =
    DEFREC_REASON_DARK | DEFREC_REASON_SATURATED | DEFREC_REASON_ONE_VIEW;

class StreamCheck {
  public:
    // frame: its number, from 0. Returns DEFREC_REASON_*: exposure, rows of two times, whether the
    // stream stands still or has a gap, and VIEW_LATE where one view alone stands still.
    uint32_t reasons(uint64_t frame, int64_t timestamp_ns, const ImageStatistics& left,
                     const ImageStatistics& right);

  private:
    uint64_t last_hash_[2] = {0, 0};
    int64_t last_timestamp_ = 0;
    int64_t usual_step_ = 0;  // ns; 0: not known
};

}  // namespace defrec
