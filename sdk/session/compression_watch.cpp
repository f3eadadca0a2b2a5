// See compression_watch.hpp.
#include "sdk/session/compression_watch.hpp"

#include "sdk/client/library.hpp"
#include "sdk/input/compression/decisions.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

// They cost depth without any compression.
constexpr std::uint32_t kOtherCauses = DEFREC_REASON_CALIBRATION | DEFREC_REASON_VIEW_LATE |
                                       DEFREC_REASON_VIEWS_SWAPPED | DEFREC_REASON_INTERLACED;

}  // namespace

std::string CompressionWatch::add(const StereoFrame& frame, const defrec_result& result) {
    if (meter_.is_complete()) return {};
    meter_.add(gray_of(frame.left), gray_of(frame.right));
    without_depth_ += 1 - depth_share(result);
    reasons_ |= result.reasons;
    ++frames_;
    return meter_.is_complete() ? sentence() : std::string();
}

std::string CompressionWatch::conclude() {
    return meter_.is_complete() ? std::string() : sentence();
}

std::string CompressionWatch::sentence() const {
    const CompressionSigns signs = meter_.signs();
    if (!signs.are_strong()) return {};
    const double without_depth = without_depth_ / frames_;
    const bool is_of_no_use = without_depth >= decisions::CompressedVideo::kMostWithoutDepth &&
                              (reasons_ & kOtherCauses) == 0;
    const std::string text =
        is_of_no_use ? "The video is compressed beyond use: no depth in " +
                           format_fixed(100 * without_depth, 0) + " % of the surface"
                     : "The video is strongly compressed, and depth errs by more than it would "
                       "without";
    return text + " (" + signs.seen() + "). " + kCompressionRemedy;
}

}  // namespace defrec::cli
