// How fast frames come, and the step of the grid that follows from it.
#pragma once
#include <cstddef>
#include <vector>

namespace defrec {

class FrameInterval {
  public:
    FrameInterval();

    // An interval between two frames, s. True where the step changes, or is the first.
    bool add(double interval_s);
    // Whether a frame that comes so much after the one before comes after a gap.
    bool is_gap(double interval_s) const;
    bool is_known() const { return step_s_ > 0; }
    double step_s() const { return step_s_; }
    // Steps until the latest time of display.
    int horizons() const;

  private:
    std::vector<double> intervals_;
    std::size_t next_ = 0;
    std::size_t unlike_ = 0;  // intervals in a row that ask for another step
    double median_ = 0, step_s_ = 0;
    double frames_per_step_ = 1;
};

}  // namespace defrec
