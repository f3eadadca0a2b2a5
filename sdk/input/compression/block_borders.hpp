// Blocks of 8 px whose borders stand out: a codec that rounds each block by itself leaves them.
#pragma once

#include <array>
#include <opencv2/core.hpp>

#include "sdk/input/compression/decisions.hpp"

namespace defrec::cli {

// One view.
class BlockBorders {
  public:
    // Gray, 8 bit.
    void add(const cv::Mat& gray);
    // How many times as much gray levels change from one block to the next as within blocks, in the
    // direction in which it is more; 1 where nothing changes.
    double ratio() const;

  private:
    // Differences of neighbours that stand at one place in their blocks.
    struct Phase {
        double sum = 0, count = 0;
    };
    using Phases = std::array<Phase, decisions::BlockBorder::kSide>;

    static void add_differences(const cv::Mat& gray, Phases& phases);
    static double ratio_of(const Phases& phases);

    // By the place in a block.
    Phases along_rows_{}, along_columns_{};
};

}  // namespace defrec::cli
