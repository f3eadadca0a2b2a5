// Which frames' views repeat the ones before: the tissue is not seen anew.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

struct RepeatedFrame {
    std::int64_t number = 0;
    bool left = false, right = false;  // which view repeats the frame before

    bool is_repeated() const { return left || right; }
};

class RepeatMeter {
  public:
    // The frames in order, each of the size of the first.
    RepeatedFrame add(const StereoFrame& frame);

  private:
    cv::Mat left_, right_;  // some rows of the frame before
};

}  // namespace defrec::cli
