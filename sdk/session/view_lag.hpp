// A run's words on views that are not of one time.
#pragma once

#include <string>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::cli {

class ViewLag {
  public:
    // Each frame of the run, but for reasons of views that stand still: those are no lag.
    void add(const defrec_result& result, bool is_one_view_still);
    int frames() const { return frames_; }
    // In so many frames that rows tell nothing of the calibration. drifted: the frames in which
    // rows speak against it.
    bool is_lasting(int drifted) const;
    bool is_in_most() const;
    // Empty for no frame.
    std::string note(int drifted) const;

  private:
    int frames_ = 0;
    int told_ = 0;              // with the reason
    std::vector<double> lags_;  // that are not 0, of frames with the reason
};

}  // namespace defrec::cli
