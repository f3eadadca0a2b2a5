// See picture_gaps.hpp.
#include "sdk/report/picture_gaps.hpp"

namespace defrec::cli {

void PictureGaps::add(double timestamp_ms, std::string_view reasons) {
    // The tracker knows the usual time between frames.
    const bool is_after_gap = reasons.find("gap") != std::string_view::npos;
    if (last_ms_ && is_after_gap && timestamp_ms - *last_ms_ >= kLeastMs) {
        ++count_;
        total_ms_ += timestamp_ms - *last_ms_;
        if (listed_.size() < kListed) listed_.push_back({*last_ms_, timestamp_ms});
    }
    last_ms_ = timestamp_ms;
}

}  // namespace defrec::cli
