// Blocks of a video that its codec copied from the frame before. A camera's noise makes no block
// twice; a codec for want of bits leaves what is new in a block out, so that only its motion is
// left. Borders of blocks need not stand out.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace defrec::cli {

// One view.
class CopiedBlocks {
  public:
    // Gray, 8 bit, frame by frame, each of the size of the first.
    void add(const cv::Mat& gray);
    // The blocks with texture count, but for those that stand still in all frames, which may be of
    // a screen; empty where there are too few to tell.
    std::optional<double> share() const;

  private:
    struct Counts {
        int textured = 0, still = 0, copied = 0;  // pairs of frames
    };

    cv::Mat before_;
    std::vector<Counts> blocks_;
};

}  // namespace defrec::cli
