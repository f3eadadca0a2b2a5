// See scan_votes.hpp.
#include "sdk/input/scan_votes.hpp"

#include <algorithm>

#include "include/defrec_c.h"

namespace defrec::cli {
namespace {

// Pairs of progressive images, from which on a video is not interlaced throughout. A cut passes for
// one.
constexpr int kProgressivePairs = 3;

defrec_image image_of(const cv::Mat& image) {
    defrec_image made;
    DEFREC_INIT(&made);
    made.format = image.channels() == 1 ? DEFREC_FORMAT_GRAY8 : DEFREC_FORMAT_BGR8;
    made.width = static_cast<std::uint32_t>(image.cols);
    made.height = static_cast<std::uint32_t>(image.rows);
    made.stride = image.step[0];
    made.pixels = image.data;
    return made;
}

}  // namespace

void ScanVotes::add(const cv::Mat& image) {
    const cv::Mat before = last_;
    last_ = image;
    if (before.size() != image.size() || before.type() != image.type()) return;
    const defrec_image earlier = image_of(before), later = image_of(image);
    std::uint32_t scan = DEFREC_SCAN_UNKNOWN;
    if (defrec_detect_scan(&earlier, &later, &scan) != DEFREC_OK) return;
    progressive_ += scan == DEFREC_SCAN_PROGRESSIVE;
    top_first_ += scan == DEFREC_SCAN_TOP_FIRST;
    bottom_first_ += scan == DEFREC_SCAN_BOTTOM_FIRST;
}

bool ScanVotes::is_settled() const {
    return progressive_ >= kProgressivePairs || std::max(top_first_, bottom_first_) >= enough_;
}

FieldOrder ScanVotes::order() const {
    if (progressive_ >= kProgressivePairs ||
        std::max(top_first_, bottom_first_) <= progressive_ + std::min(top_first_, bottom_first_))
        return FieldOrder::kProgressive;
    return top_first_ > bottom_first_ ? FieldOrder::kTopFirst : FieldOrder::kBottomFirst;
}

}  // namespace defrec::cli
