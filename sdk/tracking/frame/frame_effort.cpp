// See frame_effort.hpp.
#include "sdk/tracking/frame/frame_effort.hpp"

#include <algorithm>

#include "include/defrec_c.h"
#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {
namespace {

using decisions::Deadlines;

}  // namespace

Effort EffortTimes::choose(Time left) const {
    for (size_t i = 0; i + 1 < kEfforts; ++i)
        if (left > Time::zero() && Deadlines::kMargin * expected_[i] <= left)
            return static_cast<Effort>(i);
    return static_cast<Effort>(kEfforts - 1);
}

// What slows one effort down slows all. An effort that did not fit is tried again some day, as one
// frame may have been slow by itself, or the device is faster now; what it takes then is its time.
void EffortTimes::add(Effort effort, Time took) {
    const auto index = static_cast<size_t>(effort);
    const Time before = expected_[index];
    const bool is_mean = before > Time::zero() && !is_forgotten_[index];
    expected_[index] = is_mean ? before + Deadlines::kNewest * (took - before) : took;
    is_forgotten_[index] = false;
    for (size_t i = 0; i < kEfforts; ++i) {
        if (is_mean && i != index) expected_[i] *= expected_[index] / before;
        if (i < index) {
            expected_[i] *= 1 - Deadlines::kForgotten;
            is_forgotten_[i] = true;
        }
    }
}

uint32_t reasons_of(Effort effort) {
    uint32_t reasons = 0;
    if (effort >= Effort::kCoarse) reasons |= DEFREC_REASON_COARSE;
    if (effort >= Effort::kUnchecked) reasons |= DEFREC_REASON_UNCHECKED;
    return reasons;
}

}  // namespace defrec
