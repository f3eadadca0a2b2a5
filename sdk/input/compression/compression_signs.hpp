// Whether a codec left too little of a video, as the doctor and a run say it.
#pragma once

#include <optional>
#include <string>

#include "sdk/input/compression/block_borders.hpp"
#include "sdk/input/compression/copied_blocks.hpp"

namespace defrec::cli {

// The remedy.
inline constexpr char kCompressionRemedy[] =
    "Record at a higher rate or quality, or without loss: by `defrec record` without --format "
    "h264, by FFmpeg with -crf 17 or less.";

// The signs that the view with more of them shows.
struct CompressionSigns {
    double border_ratio = 1;       // see BlockBorders
    std::optional<double> copied;  // share of the blocks, from the frame before; empty: unknown

    bool has_borders() const;
    bool has_copies() const;
    bool are_strong() const { return has_borders() || has_copies(); }
    // By what strong compression is seen.
    std::string seen() const;
};

// Gathers the first frames of a recording; later ones do not count.
class CompressionMeter {
  public:
    // Gray, 8 bit, frame by frame, all of one size.
    void add(const cv::Mat& left, const cv::Mat& right);
    bool is_complete() const;
    CompressionSigns signs() const;

  private:
    int frames_ = 0;
    BlockBorders left_borders_, right_borders_;
    CopiedBlocks left_copies_, right_copies_;
};

}  // namespace defrec::cli
