// What is wrong with a stream of frames, from each frame's images and time alone.
#pragma once
#include <cstdint>

#include "sdk/tracking/monitors/frame_state.hpp"

namespace defrec {

class StreamCheck {
  public:
    struct Finding {
        // DEFREC_REASON_*: exposure, rows of two times, whether the stream stands still or has a
        // gap, VIEW_LATE where one view alone stands still, ONE_VIEW where one alone is of use.
        uint32_t reasons = 0;
        uint32_t faulty_views = 0;  // DEFREC_VIEW_*: of which they speak
        // Whether the view shows anything, and whether it stands still while the other does not.
        struct View {
            bool shows = true, is_frozen_alone = false;
        } left, right;
    };
    // is_bottom: it is a bottom field; one of the stream that stands still is as the last one of
    // its kind.
    Finding check(int64_t timestamp_ns, const ImageStatistics& left, const ImageStatistics& right,
                  bool is_bottom = false);

  private:
    uint64_t last_hash_[2][2] = {};  // of other frames, then of bottom fields; of each view
    bool has_last_ = false;          // a frame before
    int64_t last_timestamp_ = 0;
    int64_t usual_step_ = 0;  // ns; 0: not known
};

}  // namespace defrec
