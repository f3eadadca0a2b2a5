// See compression_watch.hpp.
#include "sdk/session/compression_watch.hpp"

#include "sdk/client/library.hpp"
#include "sdk/input/compression/decisions.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {

using decisions::CompressedVideo;

std::string CompressionWatch::add(const StereoFrame& frame, const defrec_result& result) {
    if (frames_ == CompressedVideo::kFrames) return {};
    left_.add(gray_of(frame.left));
    right_.add(gray_of(frame.right));
    without_depth_ += 1 - depth_share(result);
    ++frames_;
    return frames_ == CompressedVideo::kFrames ? sentence() : std::string();
}

std::string CompressionWatch::conclude() {
    return frames_ < CompressedVideo::kFrames ? sentence() : std::string();
}

std::string CompressionWatch::sentence() const {
    const std::optional<double> share = copied();
    if (!share || *share <= CompressedVideo::kMostCopied) return {};
    const double without_depth = without_depth_ / frames_;
    const bool is_of_no_use = without_depth >= CompressedVideo::kMostWithoutDepth;
    std::string text = is_of_no_use ? "The video is compressed beyond use: no depth in " +
                                          format_fixed(100 * without_depth, 0) + " % of the surface"
                                    : "The video is strongly compressed, and depth errs by more "
                                      "than it would without";
    return text + " (" + format_fixed(100 * *share, 1) +
           " % of the blocks of its first frames are copies of the frame before); record at a "
           "higher rate or quality, with FFmpeg -crf 17 or less.";
}

}  // namespace defrec::cli
