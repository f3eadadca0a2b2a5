// See compression_signs.hpp.
#include "sdk/input/compression/compression_signs.hpp"

#include <algorithm>

#include "sdk/input/compression/decisions.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {

using decisions::CompressedVideo;

bool CompressionSigns::has_borders() const { return border_ratio > CompressedVideo::kBorderRatio; }

bool CompressionSigns::has_copies() const {
    return copied && *copied > CompressedVideo::kMostCopied;
}

std::string CompressionSigns::seen() const {
    if (has_borders())
        return "gray levels change " + format_fixed(border_ratio, 2) +
               " times as much from one block of 8 px to the next as within blocks";
    return format_fixed(100 * copied.value_or(0), 1) +
           " % of the blocks of 16 px are copies of the frame before, which a camera never gives";
}

void CompressionMeter::add(const cv::Mat& left, const cv::Mat& right) {
    if (is_complete()) return;
    ++frames_;
    left_borders_.add(left);
    right_borders_.add(right);
    left_copies_.add(left);
    right_copies_.add(right);
}

bool CompressionMeter::is_complete() const { return frames_ == CompressedVideo::kFrames; }

CompressionSigns CompressionMeter::signs() const {
    return {std::max(left_borders_.ratio(), right_borders_.ratio()),
            std::max(left_copies_.share(), right_copies_.share())};
}

}  // namespace defrec::cli
